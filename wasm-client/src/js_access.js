// What the bindings do with JavaScript values. Layer: wasm-client/src; declared in js_access.hpp.
// No exception may cross the wasm frames (they would not be unwound): whatever can run code of the application,
// a getter or a Proxy, is caught in here and reported as handle 0 or -1.

mergeInto(LibraryManager.library, {
  // Kinds and numbers are those of js_access.hpp and of rr::DataType.
  $RrJs__deps: ['$Emval'],
  $RrJs__postset: 'RrJs.start();',
  $RrJs: {
    // This file is evaluated while linking: what belongs to the page's engine is looked up when the module starts.
    start: function() {
      RrJs.arrays = [null, Float64Array, Float32Array, Int8Array, Uint8Array, Int16Array, Uint16Array, Int32Array,
                     Uint32Array, BigInt64Array, BigUint64Array];
      RrJs.exact = Symbol.for('rrgate.exactValue');
      RrJs.type = Symbol.for('rrgate.type');
      RrJs.decoder = new TextDecoder('utf-8', { ignoreBOM: true });
      RrJs.encoder = new TextEncoder();
      // The engine's own getter: knows arrays of other realms (frames, vm contexts), runs no foreign code, never throws.
      RrJs.items_name =
          Object.getOwnPropertyDescriptor(Object.getPrototypeOf(Uint8Array.prototype), Symbol.toStringTag).get;
    },

    text: function(at, length) {
      if (length <= 32) {
        // Names: cheaper than the decoder.
        var text = '';
        for (var i = at; i < at + length; ++i) {
          if (HEAPU8[i] > 127) return RrJs.decoder.decode(HEAPU8.subarray(at, at + length));
          text += String.fromCharCode(HEAPU8[i]);
        }
        return text;
      }
      return RrJs.decoder.decode(HEAPU8.subarray(at, at + length));
    },

    items_type: function(value) {
      switch (RrJs.items_name.call(value)) {
        case 'Float64Array': return 1;
        case 'Float32Array': return 2;
        case 'Int8Array': return 3;
        case 'Uint8Array':
        case 'Uint8ClampedArray': return 4;
        case 'Int16Array': return 5;
        case 'Uint16Array': return 6;
        case 'Int32Array': return 7;
        case 'Uint32Array': return 8;
        case 'BigInt64Array': return 9;
        case 'BigUint64Array': return 10;
        default: return 0;
      }
    },

    kind: function(value) {
      switch (typeof value) {
        case 'undefined': return 0;
        case 'boolean': return 2;
        case 'number': return 3;
        case 'bigint': return 4;
        case 'string': return 5;
        case 'object': break;
        default: return 11;
      }
      if (value === null) return 1;
      if (Array.isArray(value)) return 6;
      if (RrJs.items_type(value)) return 7;
      var tag = Object.prototype.toString.call(value);
      if (tag === '[object Map]') return 8;
      if (value[RrJs.exact] === true) return 9;
      return tag === '[object ArrayBuffer]' || tag === '[object Date]' || ArrayBuffer.isView(value) ? 11 : 10;
    },

    // Members that the object or its class brings; not what every object has ("constructor").
    field: function(object, name) {
      if (Object.prototype.hasOwnProperty.call(object, name)) return object[name];
      return name in object && !(name in Object.prototype) ? object[name] : undefined;
    },
  },

  rr_js_kind__deps: ['$RrJs'],
  rr_js_kind: function(handle) {
    try {
      return RrJs.kind(Emval.toValue(handle));
    } catch (error) {
      return 11;
    }
  },

  rr_js_items_type__deps: ['$RrJs'],
  rr_js_items_type: function(handle) { return RrJs.items_type(Emval.toValue(handle)); },

  rr_js_number__deps: ['$RrJs'],
  rr_js_number: function(handle) { return Emval.toValue(handle); },

  rr_js_bigint__deps: ['$RrJs'],
  rr_js_bigint: function(handle, is_unsigned, to) {
    var value = Emval.toValue(handle);
    if (value !== (is_unsigned ? BigInt.asUintN(64, value) : BigInt.asIntN(64, value))) return 0;
    new DataView(HEAPU8.buffer).setBigUint64(to, BigInt.asUintN(64, value), true);
    return 1;
  },

  // Allocates; 0 where a surrogate stands alone: such text has no UTF-8.
  rr_js_text__deps: ['$RrJs', 'malloc'],
  rr_js_text: function(handle, length_to) {
    var text = Emval.toValue(handle);
    if (/\p{Surrogate}/u.test(text)) return 0;
    var bytes = RrJs.encoder.encode(text);
    var at = _malloc(bytes.length + 1);
    HEAPU8.set(bytes, at);
    HEAPU32[length_to >> 2] = bytes.length;
    return at;
  },

  rr_js_length__deps: ['$RrJs'],
  rr_js_length: function(handle) {
    try {
      var length = Emval.toValue(handle).length;
      return typeof length === 'number' && length >= 0 && length <= 0x7fffffff ? length : -1;
    } catch (error) {
      return -1;
    }
  },

  rr_js_item__deps: ['$RrJs'],
  rr_js_item: function(handle, index) {
    try {
      return Emval.toHandle(Emval.toValue(handle)[index]);
    } catch (error) {
      return 0;
    }
  },

  rr_js_field__deps: ['$RrJs'],
  rr_js_field: function(handle, name, length) {
    try {
      return Emval.toHandle(RrJs.field(Emval.toValue(handle), RrJs.text(name, length)));
    } catch (error) {
      return 0;
    }
  },

  rr_js_keys__deps: ['$RrJs'],
  rr_js_keys: function(handle) {
    try {
      return Emval.toHandle(Object.keys(Emval.toValue(handle)));
    } catch (error) {
      return 0;
    }
  },

  // [key, value, key, value, ...]
  rr_js_map_items__deps: ['$RrJs'],
  rr_js_map_items: function(handle) {
    try {
      var items = [];
      Map.prototype.forEach.call(Emval.toValue(handle), function(value, key) { items.push(key, value); });
      return Emval.toHandle(items);
    } catch (error) {
      return 0;
    }
  },

  // The "type" that a value brings with it, undefined where it has none.
  rr_js_type_mark__deps: ['$RrJs'],
  rr_js_type_mark: function(handle) {
    try {
      var mark = Emval.toValue(handle)[RrJs.type];
      return Emval.toHandle(typeof mark === 'string' ? mark : undefined);
    } catch (error) {
      return 0;
    }
  },

  rr_js_copy_items__deps: ['$RrJs'],
  rr_js_copy_items: function(handle, to) {
    var items = Emval.toValue(handle);
    HEAPU8.set(new Uint8Array(items.buffer, items.byteOffset, items.byteLength), to);
  },

  // Numbers of an array or TypedArray as doubles; the index of the first that is none, -1 where all are, -2 on a throw.
  rr_js_read_numbers__deps: ['$RrJs'],
  rr_js_read_numbers: function(handle, to, count) {
    try {
      var items = Emval.toValue(handle);
      for (var i = 0; i < count; ++i) {
        var item = items[i];
        if (typeof item !== 'number') return i;
        HEAPF64[(to >> 3) + i] = item;
      }
      return -1;
    } catch (error) {
      return -2;
    }
  },

  rr_js_read_booleans__deps: ['$RrJs'],
  rr_js_read_booleans: function(handle, to, count) {
    try {
      var items = Emval.toValue(handle);
      for (var i = 0; i < count; ++i) {
        var item = items[i];
        if (typeof item !== 'boolean') return i;
        HEAPU8[to + i] = item ? 1 : 0;
      }
      return -1;
    } catch (error) {
      return -2;
    }
  },

  rr_js_make_text__deps: ['$RrJs'],
  rr_js_make_text: function(at, length) { return Emval.toHandle(RrJs.text(at, length)); },

  rr_js_make_number__deps: ['$RrJs'],
  rr_js_make_number: function(value) { return Emval.toHandle(value); },

  rr_js_make_bigint__deps: ['$RrJs'],
  rr_js_make_bigint: function(at, is_unsigned) {
    var view = new DataView(HEAPU8.buffer);
    return Emval.toHandle(is_unsigned ? view.getBigUint64(at, true) : view.getBigInt64(at, true));
  },

  rr_js_make_items__deps: ['$RrJs'],
  rr_js_make_items: function(type, at, bytes) {
    return Emval.toHandle(new RrJs.arrays[type](HEAPU8.slice(at, at + bytes).buffer));
  },

  rr_js_make_booleans__deps: ['$RrJs'],
  rr_js_make_booleans: function(at, count) {
    var items = new Array(count);
    for (var i = 0; i < count; ++i) items[i] = HEAPU8[at + i] !== 0;
    return Emval.toHandle(items);
  },

  // Parts of complex numbers: every second one.
  rr_js_make_parts__deps: ['$RrJs'],
  rr_js_make_parts: function(type, at, count, part) {
    var items = new RrJs.arrays[type](count);
    var heap = type === 1 ? HEAPF64 : HEAPF32;
    var from = (type === 1 ? at >> 3 : at >> 2) + part;
    for (var i = 0; i < count; ++i) items[i] = heap[from + 2 * i];
    return Emval.toHandle(items);
  },

  rr_js_make_object__deps: ['$RrJs'],
  rr_js_make_object: function() { return Emval.toHandle({}); },
  rr_js_make_array__deps: ['$RrJs'],
  rr_js_make_array: function() { return Emval.toHandle([]); },
  rr_js_make_map__deps: ['$RrJs'],
  rr_js_make_map: function() { return Emval.toHandle(new Map()); },
  rr_js_make_view__deps: ['$RrJs'],
  rr_js_make_view: function(at, length) { return Emval.toHandle(HEAPU8.subarray(at, at + length)); },

  // Always an own property: assigning to "__proto__" would replace the prototype.
  rr_js_set_field__deps: ['$RrJs'],
  rr_js_set_field: function(handle, name, length, value) {
    var object = Emval.toValue(handle);
    var key = RrJs.text(name, length);
    if (key === '__proto__') {
      Object.defineProperty(object, key,
                            { value: Emval.toValue(value), enumerable: true, writable: true, configurable: true });
    } else {
      object[key] = Emval.toValue(value);
    }
  },

  rr_js_push__deps: ['$RrJs'],
  rr_js_push: function(handle, value) { Emval.toValue(handle).push(Emval.toValue(value)); },

  rr_js_set_key__deps: ['$RrJs'],
  rr_js_set_key: function(handle, key, value) { Emval.toValue(handle).set(Emval.toValue(key), Emval.toValue(value)); },

  rr_js_mark_type__deps: ['$RrJs'],
  rr_js_mark_type: function(handle, name, length) {
    Object.defineProperty(Emval.toValue(handle), RrJs.type, { value: RrJs.text(name, length) });
  },
});
