#include "core/wire/byte_reader.hpp"

namespace rr {

void ByteReader::fail(ErrorCode code, const char* field, std::size_t at, std::string_view problem) {
  if (!failed_) {
    error_.code = code;
    error_.message = std::string(field) + " at byte " + std::to_string(at) + ": " + std::string(problem);
  }
  failed_ = true;
  limit_ = at_;  // nothing more can be read
}

void ByteReader::fail_short(std::size_t size, const char* field) {
  fail(ErrorCode::protocol_error, field, at_,
       std::to_string(size) + " bytes needed, " + std::to_string(left()) + " left before the end of its structure");
}

}  // namespace rr
