#include <array>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <charconv>
#include <optional>

#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/http/endpoints/members.hpp"
#include "server/http/endpoints/sample_jpeg.hpp"
#include "server/http/endpoints/sample_text.hpp"
#include "server/limits/outbox.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// A stream without news for so long gets a comment: proxies and clients see that it lives.
constexpr std::chrono::seconds comment_period{15};
constexpr const char* stream_too_slow =
    "event: error\ndata: {\"detail\":\"too slow: values were lost, so the stream ends\"}\n\n";

std::string state_text(const rr::Error* error) {
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "state") = state_name(error);
  if (error) rr::add_key(out, "detail") = rr::error_to_json(*error, {})["error"]["message"];
  return "event: state\ndata: " + rr::write_json(out) + "\n\n";
}

/// `number`  of an event, by which a client that comes again goes on; nullopt: it has none.
std::string sample_event(const rr::Result<std::string>& json, std::optional<std::uint64_t> number) {
  if (!json) return "event: error\ndata: " + rr::write_json(rr::error_to_json(json.error(), {})) + "\n\n";
  return (number ? "id: " + std::to_string(*number) + "\n" : "") + "data: " + *json + "\n\n";
}

/// Streams are text, whatever else the client takes: arrays of numbers don't become the bytes of CBOR.
rr::JsonForm text_form(const ObjectRequest& request) {
  auto form = request.form();
  form.has_bytes = false;
  return form;
}

/// A line of a generator, counted in `room`. Throws   rr::Exception: those of to_json(); out_of_system_resource.
rr::awaitable<std::string> make_line(const ObjectRequest& request, const Target& target, const rr::Value& value,
                                     MemoryBudget::Charge& room) {
  const auto form = text_form(request);
  auto json = co_await json_of(target, value, form, request.gateway().workers());
  auto line = co_await request.write_document(std::move(json), false);
  // For so little there was room when the request came.
  if (line && (line->size() <= least_room || room.resize(line->size()))) co_return std::move(*line);
  request.gateway().reject(Rejection::memory);
  refuse(rr::ErrorCode::out_of_system_resource, "the gateway has no memory left for this value");
}

Response stream_head(std::string_view content_type) {
  Response head;
  head.set("Content-Type", std::string(content_type)).set("Cache-Control", "no-store");
  head.set("X-Accel-Buffering", "no");  // nginx passes it on as it comes
  return head;
}

}  // namespace

rr::awaitable<void> stream_topic(const ObjectRequest& request, const Target& target) {
  auto& writer = request.writer();
  const auto& member = *target.member;
  const auto outbox = std::make_shared<Outbox>(writer.executor(), writer.memory().sibling(), stream_too_slow);
  const OutboxOpening opening(outbox);
  const bool is_wire = member.kind == rr::MemberKind::wire;
  const bool is_event = member.kind == rr::MemberKind::event;
  SampleHandler handler = [outbox, token = opening.token(), types = target.registry, &member, is_wire, is_event,
                           form = text_form(request),
                           memory = &request.gateway().memory()](const SamplePtr& sample, const rr::Error* error) {
    if (!sample) return outbox->add(token, state_text(error));
    const auto number = is_event ? std::optional(sample->number) : std::nullopt;
    auto text = [sample, types, &member, form, memory, number] {
      return sample_event(sample_text(*sample, member, *types, form, *memory), number);
    };
    if (is_wire)
      outbox->add_newest(token, sample->bytes, std::move(text));
    else
      outbox->add(token, text());
  };
  std::uint64_t after = 0;
  const auto last_id = request.request().header("Last-Event-ID");
  std::from_chars(last_id.data(), last_id.data() + last_id.size(), after);
  auto place = target.place();
  auto listening = co_await target.client->listen(std::move(place), after, std::move(handler));
  if (!listening) throw rr::Exception(listening.error());
  const auto listener = std::move(*listening);

  const auto head = stream_head("text/event-stream");
  if (co_await writer.begin(head) || !writer.has_body()) co_return;
  const auto is_gone = std::make_shared<bool>(false);
  writer.watch([outbox, is_gone] {
    *is_gone = true;
    outbox->news().cancel();
  });
  // The first byte tells clients and proxies that the stream is there.
  auto failed = co_await writer.write(": connected\n\n");
  while (!failed && !*is_gone) {
    if (outbox->is_empty()) {
      if (outbox->has_overflown()) break;
      outbox->news().expires_after(comment_period);
      const auto [cancelled] = co_await outbox->news().async_wait(asio::as_tuple(asio::use_awaitable));
      if (!cancelled && outbox->is_empty()) failed = co_await writer.write(": \n\n");
      continue;
    }
    const auto texts = outbox->take();
    const std::vector<std::string_view> parts(texts.begin(), texts.end());
    failed = co_await writer.write(parts);
    outbox->note_sent();
  }
  if (!failed && !*is_gone) co_await writer.end();
  co_await writer.unwatch();
}

rr::awaitable<void> stream_images(const ObjectRequest& request, const Target& target) {
  struct Newest {
    explicit Newest(const asio::any_io_executor& executor) : news(executor, asio::steady_timer::time_point::max()) {}
    SamplePtr sample;
    bool is_gone = false;
    bool is_over = false;  ///< no more frames come than `sample`
    asio::steady_timer news;
  };
  auto& writer = request.writer();
  auto& gateway = request.gateway();
  const auto& member = *target.member;
  const auto newest = std::make_shared<Newest>(writer.executor());
  SampleHandler handler = [newest](const SamplePtr& sample, const rr::Error* error) {
    if (sample)
      newest->sample = sample;
    else if (error && error->code == rr::ErrorCode::invalid_state)
      newest->is_over = true;
    else
      return;  // of a device that is lost more frames come when it is back
    newest->news.cancel();
  };
  auto place = target.place();
  auto listening = co_await target.client->listen(std::move(place), 0, std::move(handler));
  if (!listening) throw rr::Exception(listening.error());
  const auto listener = std::move(*listening);

  const auto stream = stream_head("multipart/x-mixed-replace; boundary=frame");
  if (co_await writer.begin(stream) || !writer.has_body()) co_return;
  writer.watch([newest] {
    newest->is_gone = true;
    newest->news.cancel();
  });
  // Browsers show a part when the next one's boundary has come: each is followed by it at once.
  auto failed = co_await writer.write("--frame\r\n");
  while (!failed && !newest->is_gone && (newest->sample || !newest->is_over)) {
    if (!newest->sample) {
      co_await newest->news.async_wait(asio::as_tuple(asio::use_awaitable));
      continue;
    }
    auto sample = std::exchange(newest->sample, nullptr);
    const auto jpeg =
        co_await jpeg_of(std::move(sample), member.type, target.types(), gateway.memory(), gateway.workers());
    if (!jpeg) {
      log(LogLevel::debug, "frame left out", {{"member", member.name}, {"error", jpeg.error().message}});
      continue;
    }
    const std::string& image = **jpeg;
    // The client may take its time: by then the frame, with what is counted for it, has gone.
    auto room = writer.memory().sibling();
    if (!room.resize(image.size())) {
      gateway.reject(Rejection::memory);
      log(LogLevel::debug, "frame left out", {{"member", member.name}, {"error", "no memory is left for it"}});
      continue;
    }
    const auto head = "Content-Type: image/jpeg\r\nContent-Length: " + std::to_string(image.size()) + "\r\n\r\n";
    const std::array<std::string_view, 3> part{head, image, "\r\n--frame\r\n"};
    failed = co_await writer.write(part);
  }
  if (!failed && !newest->is_gone) co_await writer.end();
  co_await writer.unwatch();
}

rr::awaitable<void> stream_generator(const ObjectRequest& request, const Target& target) {
  auto& writer = request.writer();
  const auto& member = *target.member;
  if (request.method() != http::verb::post) {
    const auto response = request.method_response("POST");
    co_await writer.send(response);
    co_return;
  }
  if (member.step_parameter()) {
    const auto response =
        problem_response(501, "the generator takes values while it runs, which HTTP can't; use a WebSocket");
    co_await writer.send(response);
    co_return;
  }
  auto arguments = co_await read_arguments(request, member, target.types());
  if (!arguments) throw rr::Exception(arguments.error());
  auto opening = target.request(rr::CallKind::generator_open);
  const auto generator = opening.generator = target.client->next_generator();
  opening.arguments = std::move(*arguments);
  co_await target.client->ask(std::move(opening));

  const bool as_events = request.wants_events();
  const auto gone = std::make_shared<bool>(false);
  const auto head = stream_head(as_events ? "text/event-stream" : "application/x-ndjson");
  auto failed = co_await writer.begin(head);
  writer.watch([gone, client = target.client, generator] {
    *gone = true;
    client->drop_generator(generator);  // the step that is at work may take its time
  });
  bool has_ended = false;
  while (!failed && !*gone && !has_ended) {
    auto room = writer.memory().sibling();
    std::string line;
    try {
      auto step = target.request(rr::CallKind::generator_next);
      step.generator = generator;
      const auto value = co_await target.client->ask(std::move(step));
      line = co_await make_line(request, target, value, room);
    } catch (const rr::Exception& exception) {
      has_ended = true;
      if (exception.error().code == rr::ErrorCode::stop_iteration) break;
      line = rr::write_json(rr::error_to_json(exception.error(), target.types())) + "\n";
    }
    const std::string_view begin = !as_events ? "" : has_ended ? "event: error\ndata: " : "data: ";
    const std::array<std::string_view, 3> parts{begin, line, as_events ? "\n" : ""};
    failed = co_await writer.write(parts);
  }
  target.client->drop_generator(generator);
  if (!failed && !*gone) co_await writer.end();
  co_await writer.unwatch();
}

}  // namespace rrgate
