#include "core/types/number.hpp"

#include <cmath>

namespace rr {

namespace {

enum class Kind : std::uint8_t { integer, real, complex, boolean, none };

Kind kind_of(DataType type) {
  switch (type) {
    case DataType::double_t:
    case DataType::single_t:
      return Kind::real;
    case DataType::cdouble_t:
    case DataType::csingle_t:
      return Kind::complex;
    case DataType::bool_t:
      return Kind::boolean;
    default:
      return is_numeric(type) ? Kind::integer : Kind::none;
  }
}

bool is_signed_integer(DataType type) {
  return type == DataType::int8_t || type == DataType::int16_t || type == DataType::int32_t ||
         type == DataType::int64_t;
}

/// An integer of up to 64 bits, signed or not, as sign and magnitude.
struct Integer {
  bool is_negative = false;
  std::uint64_t magnitude = 0;
};

Integer read_integer(const Scalar& scalar) {
  const auto size = item_size(scalar.type);
  std::uint64_t bits = 0;
  std::memcpy(&bits, scalar.storage.data(), size);
  if (!is_signed_integer(scalar.type) || !(scalar.storage[size - 1] & 0x80)) return {false, bits};
  if (size < 8) bits |= ~std::uint64_t{0} << (8 * size);
  return {true, 0 - bits};
}

Conversion write_integer(Integer integer, DataType to, Scalar& out) {
  const auto value_bits = 8 * item_size(to) - (is_signed_integer(to) ? 1 : 0);
  const std::uint64_t highest = value_bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << value_bits) - 1;
  const std::uint64_t lowest = is_signed_integer(to) ? highest + 1 : 0;  // a magnitude
  if (integer.magnitude > (integer.is_negative ? lowest : highest)) return Conversion::out_of_range;
  const std::uint64_t bits = integer.is_negative ? 0 - integer.magnitude : integer.magnitude;
  out.type = to;
  std::memcpy(out.storage.data(), &bits, item_size(to));
  return Conversion::ok;
}

Conversion real_to_integer(double value, Integer& out) {
  if (!std::isfinite(value) || std::trunc(value) != value) return Conversion::wrong_kind;
  if (std::fabs(value) >= 0x1p64) return Conversion::out_of_range;
  out = {value < 0, static_cast<std::uint64_t>(std::fabs(value))};
  return Conversion::ok;
}

/// `Real` is float or double.
template <class Real>
Conversion integer_to_real(Integer integer, Real& out) {
  const auto real = static_cast<Real>(integer.magnitude);
  if (real >= static_cast<Real>(0x1p64) || static_cast<std::uint64_t>(real) != integer.magnitude)
    return Conversion::out_of_range;
  out = integer.is_negative ? -real : real;
  return Conversion::ok;
}

Conversion narrow(double value, float& out) {
  constexpr double rounds_to_infinity = 0x1.ffffffp127;  // 2^128 - 2^103, halfway above the largest float
  if (std::isfinite(value) && std::fabs(value) >= rounds_to_infinity) return Conversion::out_of_range;
  out = static_cast<float>(value);
  return Conversion::ok;
}

/// Real and imaginary part of a number of kind real or complex.
CDouble read_parts(const Scalar& scalar) {
  const auto* bytes = scalar.storage.data();
  switch (scalar.type) {
    case DataType::double_t:
      return {load<double>(bytes), 0};
    case DataType::single_t:
      return {load<float>(bytes), 0};
    case DataType::cdouble_t:
      return {load<double>(bytes), load<double>(bytes + 8)};
    default:
      return {load<float>(bytes), load<float>(bytes + 4)};
  }
}

/// Writes the parts that `to` has: double, single, cdouble or csingle.
Conversion write_parts(CDouble parts, DataType to, Scalar& out) {
  const bool is_double = to == DataType::double_t || to == DataType::cdouble_t;
  const double doubles[2] = {parts.real(), parts.imag()};
  float singles[2] = {};
  if (!is_double)
    for (int i = 0; i < 2; ++i)
      if (const auto result = narrow(doubles[i], singles[i]); result != Conversion::ok) return result;
  out.type = to;
  const void* from = is_double ? static_cast<const void*>(doubles) : singles;
  std::memcpy(out.storage.data(), from, item_size(to));
  return Conversion::ok;
}

Conversion from_integer(Integer integer, DataType to, Scalar& out) {
  if (kind_of(to) == Kind::integer) return write_integer(integer, to, out);
  double real = 0;
  if (to == DataType::single_t || to == DataType::csingle_t) {
    float single = 0;
    if (const auto result = integer_to_real(integer, single); result != Conversion::ok) return result;
    real = single;
  } else if (const auto result = integer_to_real(integer, real); result != Conversion::ok) {
    return result;
  }
  return write_parts({real, 0}, to, out);
}

/// Nine significant digits as printf's "%.9g" writes them in the C locale. printf itself would bring the whole
/// formatting of the C library into the browser's module.
std::string real_text(double value) {
  if (std::isnan(value)) return "nan";
  const std::string sign = std::signbit(value) ? "-" : "";
  double rest = std::fabs(value);
  if (std::isinf(rest)) return sign + "inf";
  if (rest == 0) return sign + "0";
  int exponent = 0;
  for (; rest >= 10; rest /= 10) ++exponent;
  for (; rest < 1; rest *= 10) --exponent;
  std::string digits = std::to_string(static_cast<std::uint32_t>(std::nearbyint(rest * 1e8)));
  if (digits.size() > 9) ++exponent;  // 9.999999999 became 10
  digits.erase(digits.find_last_not_of('0') + 1);
  const auto point = [](std::string text, std::size_t position) {
    if (text.size() > position) text.insert(position, ".");
    return text;
  };
  if (exponent < -4) return sign + point(digits, 1) + (exponent > -10 ? "e-0" : "e-") + std::to_string(-exponent);
  if (exponent >= 9) return sign + point(digits, 1) + (exponent < 10 ? "e+0" : "e+") + std::to_string(exponent);
  if (exponent < 0) return sign + "0." + std::string(static_cast<std::size_t>(-1 - exponent), '0') + digits;
  const auto whole = static_cast<std::size_t>(exponent) + 1;
  if (digits.size() < whole) digits.resize(whole, '0');
  return sign + point(digits, whole);
}

}  // namespace

Conversion convert_number(const Scalar& from, DataType to, Scalar& out) {
  const auto from_kind = kind_of(from.type);
  const auto to_kind = kind_of(to);
  if (from_kind == Kind::none || to_kind == Kind::none) return Conversion::wrong_kind;
  if (from.type == to) {
    out = from;
    return Conversion::ok;
  }
  if (from_kind == Kind::boolean || to_kind == Kind::boolean) return Conversion::wrong_kind;
  if (from_kind == Kind::integer) return from_integer(read_integer(from), to, out);
  if (from_kind == Kind::complex && to_kind != Kind::complex) return Conversion::wrong_kind;
  const auto parts = read_parts(from);
  if (to_kind != Kind::integer) return write_parts(parts, to, out);
  Integer integer;
  if (const auto result = real_to_integer(parts.real(), integer); result != Conversion::ok) return result;
  return write_integer(integer, to, out);
}

std::string number_text(const Scalar& number) {
  switch (kind_of(number.type)) {
    case Kind::boolean:
      return number.storage[0] ? "true" : "false";
    case Kind::integer: {
      const auto integer = read_integer(number);
      return (integer.is_negative ? "-" : "") + std::to_string(integer.magnitude);
    }
    case Kind::real:
      return real_text(read_parts(number).real());
    case Kind::complex: {
      const auto parts = read_parts(number);
      const auto imaginary = real_text(parts.imag());
      return real_text(parts.real()) + (imaginary.front() == '-' ? "" : "+") + imaginary + "i";
    }
    case Kind::none:
      break;
  }
  return "?";
}

}  // namespace rr
