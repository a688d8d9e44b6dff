#include "server/http/response_writer.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstdio>
#include <utility>

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Of requests that come while another one is being answered. More waits in the socket, and the client's end behind it.
constexpr std::size_t max_early_bytes = 16 * 1024;

}  // namespace

struct ResponseWriter::Watch {
  explicit Watch(const asio::any_io_executor& executor) : ended(executor, asio::steady_timer::time_point::max()) {}

  std::function<void()> on_gone;
  rr::Bytes early;  ///< what the client sent meanwhile: its next request
  bool is_over = false;
  bool is_done = false;
  asio::steady_timer ended;
};

std::string ResponseWriter::head_of(const Response& response) const {
  Response whole;
  whole.status = response.status;
  whole.headers = response.headers;
  whole.headers.insert(whole.headers.end(), headers_.begin(), headers_.end());
  const auto sets_cookie = [](const auto& header) { return header.first == "Set-Cookie"; };
  if (cookie_ && std::ranges::none_of(whole.headers, sets_cookie))
    if (auto cookie = cookie_(); !cookie.empty()) whole.set("Set-Cookie", std::move(cookie));
  whole.body = response.body;
  whole.is_streamed = is_streamed_;
  return format_response_head(whole, goes_on(), minor_version());
}

Response refuse_for_memory(Metrics* metrics) {
  if (metrics) metrics->reject(Rejection::memory);
  auto response = problem_response(503, "the gateway has no memory left for this; try again in a moment");
  response.set("Retry-After", "2");
  return response;
}

rr::awaitable<rr::error_code> ResponseWriter::write_slices(std::span<const rr::ByteSpan> slices) {
  std::size_t bytes = 0;
  for (const auto& slice : slices) bytes += slice.size();
  slow_.arm(patience_ + std::chrono::milliseconds(bytes * 1000 / least_rate));
  const auto error = co_await stream_.write(slices);
  slow_.disarm();
  co_return error;
}

rr::awaitable<std::optional<Response>> ResponseWriter::read_body(std::size_t limit) {
  const RequestReader::HasRoom has_room = [this](std::size_t bytes) {
    if (!is_urgent(bytes)) return memory_.resize(bytes);
    memory_.hold(bytes);
    return true;
  };
  body_failure_ = co_await reader_.read_body(request_, has_room, limit);
  is_whole_ = std::chrono::steady_clock::now();
  if (!body_failure_) co_return std::nullopt;
  // To a client that is gone it does not matter which.
  co_return problem_response(body_failure_->status == 0 ? 400 : body_failure_->status, body_failure_->detail);
}

void ResponseWriter::note_begin(const Response& response) {
  if (const auto begun = std::exchange(on_begin_, nullptr)) begun(response.status);
  if (!metrics_) return;
  metrics_->respond(response.status);
  const auto is_image = [](const auto& header) {
    return header.first == "Content-Type" && header.second.starts_with("image/");
  };
  if (!is_streamed_ && std::ranges::none_of(response.headers, is_image))
    metrics_->request_ages.add(std::chrono::steady_clock::now() - is_whole_);
}

bool ResponseWriter::make_room(const std::shared_ptr<const std::string>& body) {
  // What others hold as well costs nothing more. For so little there was room when the request came.
  if (!body || body.use_count() > 1 || body->size() <= least_room) return true;
  return memory_.resize(memory_.bytes() + body->size());
}

rr::awaitable<rr::error_code> ResponseWriter::send(const Response& whole) {
  const bool fits = is_vital_ || make_room(whole.body);
  const Response no_memory = fits ? Response() : refuse_for_memory(metrics_);
  const Response& response = fits ? whole : no_memory;
  if (response.closes) closes_ = true;
  note_begin(response);
  const auto head = head_of(response);
  const bool sends_body = response.body && has_body();
  const rr::ByteSpan parts[] = {rr::as_bytes(head), sends_body ? rr::as_bytes(*response.body) : rr::ByteSpan()};
  const std::span<const rr::ByteSpan> slices(parts, sends_body ? 2 : 1);
  co_return co_await write_slices(slices);
}

rr::awaitable<rr::error_code> ResponseWriter::begin(const Response& head) {
  is_streamed_ = true;
  note_begin(head);
  if (minor_version() == 0) closes_ = true;
  const auto text = head_of(head);
  const auto slice = rr::as_bytes(text);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  co_return co_await write_slices(slices);
}

rr::awaitable<rr::error_code> ResponseWriter::write(std::string_view text) {
  if (text.empty()) co_return rr::error_code();
  const std::span<const std::string_view> parts(&text, 1);
  co_return co_await write(parts);
}

rr::awaitable<rr::error_code> ResponseWriter::write(std::span<const std::string_view> parts) {
  if (!has_body()) co_return rr::error_code();
  std::size_t bytes = 0;
  for (const auto part : parts) bytes += part.size();
  char size[24];
  const auto length = std::snprintf(size, sizeof size, "%zx\r\n", bytes);
  const bool is_chunked = minor_version() == 1;
  std::vector<rr::ByteSpan> slices;
  if (is_chunked) slices.push_back(rr::as_bytes(std::string_view(size, static_cast<std::size_t>(length))));
  for (const auto part : parts) slices.push_back(rr::as_bytes(part));
  if (is_chunked) slices.push_back(rr::as_bytes(std::string_view("\r\n")));
  co_return co_await write_slices(slices);
}

rr::awaitable<rr::error_code> ResponseWriter::end() {
  if (minor_version() == 0 || !has_body()) co_return rr::error_code();
  const auto slice = rr::as_bytes("0\r\n\r\n");
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  co_return co_await write_slices(slices);
}

void ResponseWriter::watch(std::function<void()> on_gone) {
  watch_ = std::make_shared<Watch>(stream_.executor());
  watch_->on_gone = std::move(on_gone);
  asio::co_spawn(stream_.executor(), read_while(watch_, stream_), asio::detached);
}

/// Bytes are the next request, which waits; their absence is the client's end. Of one that sends more than waits, no
/// end would be noticed: it is taken for gone.
rr::awaitable<void> ResponseWriter::read_while(std::shared_ptr<Watch> watch, rr::ByteStream& stream) {
  std::array<std::uint8_t, 4096> buffer;
  bool is_gone = false;
  while (!is_gone && !watch->is_over) {
    const auto read = co_await stream.read_some(buffer);
    watch->early.insert(watch->early.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(read.bytes));
    is_gone = read.bytes == 0 || watch->early.size() > max_early_bytes;
  }
  watch->is_done = true;
  if (is_gone && !watch->is_over) {
    watch->on_gone();
    stream.close();  // what is being written waits for nobody
  }
  watch->ended.cancel();
}

rr::awaitable<void> ResponseWriter::unwatch() {
  if (!watch_) co_return;
  watch_->is_over = true;
  if (!watch_->is_done) stream_.cancel();
  while (!watch_->is_done) co_await watch_->ended.async_wait(asio::as_tuple(asio::use_awaitable));
  stream_.put_back(watch_->early);
  watch_.reset();
}

}  // namespace rrgate
