// The loader that Emscripten writes, and the session of src/wasm_session.hpp behind it. Layer: wasm-client/ts.

export interface WasmSession {
  set_now(steady: number, utc: number): void;
  receive_buffer(size: number): number;
  handle_bytes(size: number): void;
  handle_transmitted(size: number): void;
  handle_timeout(): void;
  handle_closed(reason: string): void;
  set_request_timeout(milliseconds: number): void;
  get_property(path: string, member: string): number;
  set_property(path: string, member: string, value: unknown): number;
  call_function(path: string, member: string, args: readonly unknown[]): number;
  find_object(path: string): number;
  connect_wire(path: string, member: string): number;
  disconnect_wire(path: string, member: string): number;
  peek_in_value(path: string, member: string): number;
  peek_out_value(path: string, member: string): number;
  poke_out_value(path: string, member: string, value: unknown): number;
  send_wire(path: string, member: string, value: unknown): boolean;
  cancel(id: number): void;
  disconnect(): void;
  poll_transmit(limit: number): Uint8Array | undefined;
  wants_close(): boolean;
  poll_timeout(): number;
  poll_event(): unknown;
  take_error(): unknown;
  queued_bytes(): number;
  stats(): unknown;
  peer(): unknown;
  attributes(): unknown;
  definitions(): unknown;
  members(path: string): unknown;
  child_path(parent: string, member: string, index: string | undefined): string;
  delete(): void;
}

export interface WasmModule {
  readonly HEAPU8: Uint8Array;
  readonly Session: new (options: object, steady: number, utc: number) => WasmSession;
}

export default function createRrgate(options: {
  instantiateWasm(
    imports: WebAssembly.Imports,
    done: (instance: WebAssembly.Instance) => void,
  ): Record<string, never>;
}): Promise<WasmModule>;
