#include "core/wire/gather_writer.hpp"

namespace rr {

void GatherWriter::begin(std::size_t message_size, std::size_t gathered_size) {
  message_size_ = message_size;
  out_.scratch_.resize(message_size - gathered_size);
}

void GatherWriter::payload(ByteSpan view) {
  if (view.data() == out_.marked_) out_.marked_at_ = at_;
  if (!is_gathered(view)) return bytes(view);
  close_slice();
  out_.slices_.push_back(view);
  out_.size_ += view.size();
}

Result<> GatherWriter::finish(const Message& message) {
  close_slice();
  if (overflowed_ || at_ != out_.scratch_.size() || out_.size_ != message_size_) {
    out_.clear();
    return make_error(ErrorCode::internal_error, "encode: the message has another size than computed");
  }
  if (out_.slices_.size() > 1) out_.owners_ = message.owners();
  return {};
}

void GatherWriter::close_slice() {
  if (at_ == slice_start_) return;
  out_.slices_.emplace_back(out_.scratch_.data() + slice_start_, at_ - slice_start_);
  out_.size_ += at_ - slice_start_;
  slice_start_ = at_;
}

}  // namespace rr
