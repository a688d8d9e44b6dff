#include "server/access/logins.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <set>

#include "node/tls/digest.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::minutes password_memory{5};
constexpr std::size_t max_known_passwords = 1000;

rr::Now steady_clock_now() {
  return {std::chrono::steady_clock::now(), {}};
}

std::string limited_as(const DeviceLogin& login) {
  return "at " + login.device + ' ' + login.user;
}

std::string limited_as(const rr::LoginAttempt& attempt) {
  return "here " + attempt.username;
}

}  // namespace

Logins::Logins(asio::any_io_executor executor, Access& access)
    : executor_(std::move(executor)), access_(access), salt_(rr::random_bytes(32)), known_(max_known_passwords) {}

Logins::~Logins() {
  judge_.stop();
  judge_.join();
}

/// Empty: there is no password.
std::string Logins::key_of(const rr::LoginAttempt& attempt) const {
  const auto* credential = attempt.credentials.find("password");
  const auto password = credential ? credential->to_text() : rr::Result<std::string_view>(std::string_view());
  if (!credential || !password) return {};
  rr::Bytes text = salt_;
  for (const auto part : {std::string_view(attempt.username), std::string_view("\0", 1), *password})
    text.insert(text.end(), part.begin(), part.end());
  return std::string(rr::as_text(rr::sha256(text)));
}

void Logins::judge(rr::LoginAttempt attempt, ClientOrigin from, Of of, Done done) {
  const auto now = steady_clock_now();
  const auto answer = [this, &done](Judged result) {
    asio::post(executor_, [done = std::move(done), result = std::move(result)] { done(result); });
  };
  const auto users = access_.state().users;
  if (!users) return answer(rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed"));
  if (known_in_ != users) known_.clear();
  known_in_ = users;
  const auto key = key_of(attempt);
  if (const auto* known = known_.find(key); known && now.steady < known->ends) {
    const Judged user = known->user;
    if (of == Of::request) return answer(user);
    if (const auto recordable = access_.audit().admit(); !recordable) return answer(recordable.error());
    record(attempt, from, user);
    return answer(user);
  }
  auto ticket = limits_.begin(limited_as(attempt), from.network, now);
  if (!ticket) return answer(ticket.error());
  if (const auto recordable = access_.audit().admit(); !recordable) return answer(recordable.error());
  auto& of_network = waiting_[from.network];
  if (of_network.empty()) turns_.push_back(from.network);
  of_network.push_back({std::make_shared<const rr::LoginAttempt>(std::move(attempt)), std::move(from), of,
                        std::move(done), key, users, std::move(*ticket)});
  judge_next();
}

rr::awaitable<Logins::Judged> Logins::judge(rr::LoginAttempt attempt, ClientOrigin from, Of of) {
  constexpr asio::use_awaitable_t<> token;
  return asio::async_initiate<const asio::use_awaitable_t<>, void(Judged)>(
      [this, attempt = std::move(attempt), from = std::move(from), of](auto handler) mutable {
        const auto kept = std::make_shared<decltype(handler)>(std::move(handler));
        judge(std::move(attempt), std::move(from), of, [kept](const Judged& result) { std::move (*kept)(result); });
      },
      token);
}

/// A network that has not failed lately, of these one that has the fewest passwords waiting: a flood of wrong ones
/// keeps its own senders waiting, also while none of theirs has been judged, where each sends several. Of four turns
/// one is the others' too: somebody may have mistyped.
std::deque<std::string>::iterator Logins::next_turn() {
  if (turns_taken_++ % 4 == 3) return turns_.begin();
  const auto now = steady_clock_now();
  return std::ranges::min_element(turns_, {}, [&](const std::string& network) {
    return std::pair(limits_.has_failed_lately(network, now), passwords_of(network));
  });
}

/// How many different ones are waiting: a page sends one and the same with each of its requests.
std::size_t Logins::passwords_of(const std::string& network) const {
  const auto& jobs = waiting_.at(network);
  std::set<std::string_view> keys;
  for (const auto& job : jobs) keys.insert(job.key);
  return keys.size();
}

void Logins::judge_next() {
  if (is_judging_ || turns_.empty()) return;
  is_judging_ = true;
  const auto turn = next_turn();
  const auto network = std::move(*turn);
  turns_.erase(turn);
  const auto found = waiting_.find(network);
  auto job = std::move(found->second.front());
  found->second.pop_front();
  if (found->second.empty())
    waiting_.erase(found);
  else
    turns_.push_back(network);
  asio::post(judge_, [this, executor = executor_, life = std::weak_ptr(life_), job = std::move(job)] {
    Judged result = rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed");
    try {
      result = judge_login(*job.users, *job.attempt);
    } catch (const std::exception&) {  // out of memory: the client hears that it has failed
    }
    asio::post(executor, [this, life, job, result = std::move(result)] {
      if (!life.expired()) finish(job, result);
    });
  });
}

void Logins::finish(const Job& job, const Judged& result) {
  is_judging_ = false;
  const auto now = steady_clock_now();
  record(*job.attempt, job.from, result);
  std::vector<Done> same{job.done};
  if (!result) {
    limits_.handle_failure(limited_as(*job.attempt), job.from.network, now);
  } else if (known_in_ == job.users && !job.key.empty()) {
    known_.at(job.key) = {*result, now.steady + password_memory};
    // A page asks for many things at once, all with one password.
    if (const auto found = waiting_.find(job.from.network); found != waiting_.end())
      std::erase_if(found->second, [&](const Job& other) {
        const bool is_same = other.key == job.key && other.users == job.users;
        if (!is_same) return false;
        if (other.of == Of::session) record(*other.attempt, other.from, result);
        same.push_back(other.done);
        return true;
      });
    if (const auto found = waiting_.find(job.from.network); found != waiting_.end() && found->second.empty()) {
      waiting_.erase(found);
      std::erase(turns_, job.from.network);
    }
  }
  judge_next();
  for (const auto& done : same) done(result);
}

void Logins::record(const rr::LoginAttempt& attempt, const ClientOrigin& from, const Judged& result) {
  const AccessRequest what{.service = attempt.service, .verb = Verb::read};
  Identity who;
  who.name = attempt.username;
  who.client = from.client;
  who.face = from.face;
  if (result) who = access_.logged_in(*result, from.client, from.face);
  access_.record({.event = result ? "login" : "login_failed",
                  .who = &who,
                  .what = attempt.service.empty() ? nullptr : &what,
                  .detail = result ? std::string_view() : std::string_view(result.error().message),
                  .outcome = result ? Outcome::ok : Outcome::refused});
}

rr::Result<LoginLimits::Ticket> Logins::begin_at_device(const DeviceLogin& login) {
  if (const auto recordable = access_.audit().admit(); !recordable) return recordable.error();
  return limits_.begin(limited_as(login), login.from.network, steady_clock_now());
}

void Logins::finish_at_device(const DeviceLogin& login, const rr::Result<>& result) {
  const bool is_wrong = !result && result.error().code == rr::ErrorCode::authentication_error;
  if (!result && !is_wrong) return;  // it was not judged
  if (is_wrong) limits_.handle_failure(limited_as(login), login.from.network, steady_clock_now());
  Identity who;
  who.client = login.from.client;
  who.face = login.from.face;
  who.device_user = login.user;
  const AccessRequest what{.device = login.device, .service = login.service, .verb = Verb::read};
  access_.record({.event = is_wrong ? "login_failed" : "login",
                  .who = &who,
                  .what = &what,
                  .detail = is_wrong ? "the device refused it" : "",
                  .outcome = is_wrong ? Outcome::refused : Outcome::ok});
}

}  // namespace rrgate
