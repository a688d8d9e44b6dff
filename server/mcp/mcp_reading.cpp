// What agents read and hear. Layer: server/mcp. See docs/mcp.md.
#include <algorithm>
#include <chrono>

#include "core/types/value_size.hpp"
#include "server/http/endpoints/large_json.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_recordings.hpp"
#include "server/mcp/mcp_summary.hpp"
#include "server/mcp/mcp_tools.hpp"

namespace rrgate {

namespace {

using std::chrono::steady_clock;

/// What a wire may take to tell its newest value with its time.
constexpr std::chrono::milliseconds wire_wait{500};
/// Of events and packets that are told together: what comes then is for the next request.
constexpr std::size_t most_heard = 100;
constexpr std::size_t most_heard_bytes = 1024u * 1024;
/// In memory; as JSON it is about as long or longer, and no answer has room for it.
constexpr std::size_t largest_value = 1024u * 1024;

milliseconds wait_of(const JsonRequest& arguments, milliseconds longest) {
  const auto* wanted = arguments.find("seconds");
  if (!wanted) return std::min(longest, milliseconds(10'000));
  if (!wanted->is_number() || wanted->get<double>() <= 0 || wanted->get<double>() * 1000 > double(longest.count()))
    refuse(rr::ErrorCode::invalid_argument, "\"seconds\" is " + rr::quote(wanted->dump()) +
                                                ", expected a number above 0, at most " +
                                                std::to_string(longest.count() / 1000));
  return milliseconds(static_cast<std::int64_t>(wanted->get<double>() * 1000));
}

/// What a listener has heard, for the coroutine that waits for it.
struct Heard {
  std::vector<SamplePtr> samples;
  std::size_t wanted = 1;
  std::size_t bytes = 0;
  std::optional<rr::Error> error;

  bool is_full() const { return samples.size() >= wanted || bytes > most_heard_bytes; }
  bool is_over() const { return is_full() || error; }
};

SampleHandler note_samples(std::shared_ptr<Heard> heard, std::function<void()> wake) {
  return [heard = std::move(heard), wake = std::move(wake)](const SamplePtr& sample, const rr::Error* error) {
    if (heard->is_over()) return;
    if (sample) {
      heard->samples.push_back(sample);
      heard->bytes += sample->bytes;
    } else if (error) {
      heard->error = *error;
    }
    if (heard->is_over()) wake();
  };
}

/// A wire, for as long as it is watched.
struct Watched {
  std::size_t count = 0;
  SamplePtr first;
  SamplePtr last;
  steady_clock::time_point first_time;
  steady_clock::time_point last_time;
  McpSummary numbers;
  std::optional<rr::Error> error;

  void add(const SamplePtr& sample, const Target& target) {
    last_time = steady_clock::now();
    last = sample;
    if (++count == 1) {
      first = sample;
      first_time = last_time;
    }
    if (sample->bytes > large_json_bytes) return;  // the gateway's thread has no time for these
    const auto json = rr::value_to_json(sample->values.at(0), target.member->type, target.types(), {});
    if (json) numbers.add(*json);
  }
};

SampleHandler watch_samples(std::shared_ptr<Watched> watched, TargetPtr target, std::function<void()> wake) {
  return [watched = std::move(watched), target = std::move(target), wake = std::move(wake)](const SamplePtr& sample,
                                                                                            const rr::Error* error) {
    if (watched->error) return;
    if (sample) return watched->add(sample, *target);
    if (!error) return;
    watched->error = *error;
    wake();
  };
}

}  // namespace

std::int64_t age_ms(const rr::TimeSpec& time, std::chrono::system_clock::time_point now) {
  constexpr std::int64_t farthest = 1'000'000'000'000'000;  // seconds: devices say any
  const auto passed = std::chrono::duration_cast<milliseconds>(now.time_since_epoch()).count();
  return passed - std::clamp(time.seconds, -farthest, farthest) * 1000 - time.nanoseconds / 1'000'000;
}

McpTools::Answer McpTools::devices(JsonRequestPtr arguments) {
  co_return list_for_agent(gateway_, who(), arguments->text("cursor", ""));
}

McpTools::Answer McpTools::describe(JsonRequestPtr arguments) {
  const auto target = co_await find(arguments);
  auto verb = Verb::read;
  if (target->member)
    for (const auto use : uses_of(*target->member))
      if (gateway_.access().state().rules.check(who(), access_request(*target, use))) verb = use;
  allow(*target, verb);
  co_return describe_for_agent(gateway_, who(), *target, arguments->text("cursor", ""));
}

McpTools::Answer McpTools::read(JsonRequestPtr arguments) {
  const auto target = co_await find(arguments);
  admit(*target, Verb::read);
  co_return co_await read_target(arguments, target);
}

McpTools::Answer McpTools::read_target(JsonRequestPtr arguments, TargetPtr target) {
  const auto& member =
      expect_member(*target, "read", {rr::MemberKind::property, rr::MemberKind::wire, rr::MemberKind::memory});
  if (member.kind != rr::MemberKind::memory) expect_direction(member, rr::MemberDirection::writeonly);
  has_asked_device_ = true;
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "member") = name_of(*target);
  if (target->is_shape) {  // all that who may write it alone may read of a memory
    const auto shape = co_await memory_shape(*target);
    rr::add_key(out, from_device) = rr::OrderedJson(shape);
    co_return out;
  }
  if (member.kind == rr::MemberKind::memory) {
    const JsonMaking making{gateway_.workers(), {}};
    auto items = co_await read_memory(arguments, target, making);
    rr::add_key(out, from_device) = std::move(items);
    co_return out;
  }
  auto how = rr::CallKind::property_get;
  if (member.kind == rr::MemberKind::wire) {
    how = rr::CallKind::peek_in;
    const auto heard = std::make_shared<Heard>();
    auto place = target->place();
    auto handler = note_samples(heard, reply_.waker());
    const auto listener = value_or_throw(co_await target->client->listen(std::move(place), 0, std::move(handler)));
    const std::function<bool()> is_over = [heard] { return heard->is_over(); };
    co_await reply_.wait(wire_wait, is_over);
    if (!heard->samples.empty()) {
      const auto& sample = *heard->samples.front();
      rr::add_key(out, "age_ms") = age_ms(sample.time, std::chrono::system_clock::now());
      co_await add_value(out, *target, sample.values.at(0));
      co_return out;
    }
  }
  const auto value = co_await target->ask(how);
  co_await add_value(out, *target, value);
  co_return out;
}

rr::awaitable<void> McpTools::add_value(rr::OrderedJson& answer, const Target& target, const rr::Value& value) {
  const auto& type = target.member->type;
  if (!is_image_type(type, target.types())) {
    if (rr::held_bytes(value) > largest_value)
      refuse(rr::ErrorCode::buffer_limit_violation,
             "the value has " + std::to_string(rr::held_bytes(value)) + " bytes, more than an answer has room for");
    rr::add_key(answer, from_device) = to_json(target, value, {});
    co_return;
  }
  const auto work = value_or_throw(prepare_mcp_image(value, type, target.types()));
  const auto encode = [&work] { return make_mcp_image(work); };
  image_ = value_or_throw(co_await gateway_.workers().run(encode));
  auto about = rr::OrderedJson::object();
  rr::add_key(about, "type") = image_->media_type;
  rr::add_key(about, "bytes") = image_->bytes.size();
  if (image_->width > 0) {
    rr::add_key(about, "width") = image_->width;
    rr::add_key(about, "height") = image_->height;
  }
  rr::add_key(answer, "image") = std::move(about);
}

McpTools::Answer McpTools::wait_for_event(JsonRequestPtr arguments) {
  const auto longest = wait_of(*arguments, gateway_.config().mcp.longest_wait);
  const auto* count = arguments->find("count");
  const auto heard = std::make_shared<Heard>();
  if (count) heard->wanted = count_of(*count, "count", most_heard);
  const auto target = co_await find(arguments);
  const auto& member = expect_member(*target, "wait_for_event", {rr::MemberKind::event, rr::MemberKind::pipe});
  const bool is_pipe = member.kind == rr::MemberKind::pipe;
  if (is_pipe) expect_direction(member, rr::MemberDirection::writeonly);
  const bool is_image = is_pipe && is_image_type(member.type, target->types());
  if (is_image && count) refuse(rr::ErrorCode::invalid_argument, "images come one at a time, without \"count\"");
  const auto entry = admit(*target, Verb::subscribe);
  has_asked_device_ = true;
  auto place = target->place();
  auto handler = note_samples(heard, reply_.waker());
  const auto listener = value_or_throw(co_await target->client->listen(std::move(place), 0, std::move(handler)));
  if (entry) entry->finish({});
  const std::function<bool()> is_over = [&] {
    go_on(*target, Verb::subscribe);
    reply_.note(std::to_string(heard->samples.size()) + " so far");
    return heard->is_over();
  };
  co_await reply_.wait(longest, is_over);
  go_on(*target, Verb::subscribe);
  if (heard->error && heard->samples.empty()) throw rr::Exception(*heard->error);
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "member") = name_of(*target);
  rr::add_key(out, "happened") = !heard->samples.empty();
  if (is_image && !heard->samples.empty()) {
    co_await add_value(out, *target, heard->samples.front()->values.at(0));
    co_return out;
  }
  const rr::JsonForm form;
  auto list = rr::OrderedJson::array();
  for (const auto& sample : heard->samples)
    list.push_back(value_or_throw(sample_to_json(*sample, member, target->types(), form)));
  if (count)
    rr::add_key(out, from_device) = std::move(list);
  else if (!list.empty())
    rr::add_key(out, from_device) = std::move(list.front());
  co_return out;
}

McpTools::Answer McpTools::watch(JsonRequestPtr arguments) {
  const auto longest = wait_of(*arguments, gateway_.config().mcp.longest_wait);
  const auto target = co_await find(arguments);
  const auto& member = expect_member(*target, "watch", {rr::MemberKind::wire});
  expect_direction(member, rr::MemberDirection::writeonly);
  const auto entry = admit(*target, Verb::subscribe);
  has_asked_device_ = true;
  const auto watched = std::make_shared<Watched>();
  auto place = target->place();
  auto handler = watch_samples(watched, target, reply_.waker());
  const auto listener = value_or_throw(co_await target->client->listen(std::move(place), 0, std::move(handler)));
  if (entry) entry->finish({});
  const std::function<bool()> is_over = [&] {
    go_on(*target, Verb::subscribe);
    reply_.note(std::to_string(watched->count) + " values so far");
    return watched->error.has_value();
  };
  co_await reply_.wait(longest, is_over);
  go_on(*target, Verb::subscribe);
  if (watched->error && watched->count == 0) throw rr::Exception(*watched->error);
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "member") = name_of(*target);
  rr::add_key(out, "count") = watched->count;
  rr::add_key(out, "was_lost") = watched->error.has_value();
  if (watched->count == 0) co_return out;
  const std::chrono::duration<double> between = watched->last_time - watched->first_time;
  if (watched->count > 1 && between.count() > 0)
    rr::add_key(out, "per_second") = static_cast<double>(watched->count - 1) / between.count();
  rr::add_key(out, "age_ms") = age_ms(watched->last->time, std::chrono::system_clock::now());
  if (is_image_type(member.type, target->types())) {
    co_await add_value(out, *target, watched->last->values.at(0));
    co_return out;
  }
  auto& said = rr::add_key(out, from_device) = rr::OrderedJson::object();
  rr::add_key(said, "first") = to_json(*target, watched->first->values.at(0), {});
  rr::add_key(said, "last") = to_json(*target, watched->last->values.at(0), {});
  rr::add_key(said, "numbers") = watched->numbers.to_json();
  co_return out;
}

ResourceName parse_resource(const std::string& uri) {
  if (!uri.starts_with(device_scheme))
    refuse(rr::ErrorCode::resource_not_found, "the URI is " + rr::quote(uri) + ", expected rrgate://DEVICE/PATH");
  const auto rest = uri.substr(device_scheme.size());
  const auto slash = std::min(rest.find('/'), rest.size());
  const auto name = value_or_throw(split_path(rest.substr(0, slash)));
  return {name.empty() ? "" : name.front(), rest.substr(std::min(slash + 1, rest.size()))};
}

JsonRequestPtr request_of(const ResourceName& resource) {
  auto arguments = rr::Json::object();
  arguments["device"] = resource.device;
  arguments["path"] = resource.path;
  return std::make_shared<const JsonRequest>(value_or_throw(JsonRequest::from_json(std::move(arguments))));
}

rr::awaitable<rr::OrderedJson> McpTools::read_resource(const std::string& uri) {
  if (uri.starts_with(recording_scheme)) co_return co_await read_recording(uri);
  const auto named = parse_resource(uri);
  if (named.path.empty()) co_return device_for_agent(gateway_, who(), find_device(named.device, ""));
  const auto request = request_of(named);
  const auto target = co_await find(request);
  admit(*target, Verb::read);
  if (!target->member) co_return describe_for_agent(gateway_, who(), *target, "");
  co_return co_await read_target(request, target);
}

}  // namespace rrgate
