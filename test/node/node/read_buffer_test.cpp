// Where connections read to.
#include "node/platform/read_buffer.hpp"

#include <catch2/catch.hpp>

using rr::ReadBuffer;

TEST_CASE("who says little has little room, and who says much has more, until he has not for a while") {
  constexpr std::size_t large = 64 * 1024;
  CHECK(ReadBuffer(100).renew().size() == 100);
  ReadBuffer buffer(large);
  CHECK(buffer.renew().size() == ReadBuffer::small_size);
  buffer.note_read(ReadBuffer::much - 1);
  CHECK(buffer.renew().size() == ReadBuffer::small_size);
  buffer.note_read(ReadBuffer::much);
  CHECK(buffer.room().size() == ReadBuffer::small_size);  // something in it may be needed
  CHECK(buffer.renew().size() == large);
  for (int round = 0; round < 2; ++round) {
    for (unsigned i = 1; i < ReadBuffer::few_reads; ++i) buffer.note_read(1);
    CHECK(buffer.renew().size() == large);
    buffer.note_read(large);  // counts anew
  }
  for (unsigned i = 0; i < ReadBuffer::few_reads; ++i) buffer.note_read(1);
  CHECK(buffer.room().size() == large);
  CHECK(buffer.renew().size() == ReadBuffer::small_size);
  buffer.note_read(ReadBuffer::small_size);
  CHECK(buffer.renew().size() == large);
}
