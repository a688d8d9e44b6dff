#include "server/access/audit_log.hpp"

#include <utility>

namespace rrgate {

namespace {

constexpr std::chrono::seconds retry_period{1};
/// Written at a time.
constexpr std::size_t max_batch_bytes = 32 * 1024;
/// What is admitted while so much waits has room for its record.
constexpr std::size_t much_waiting = AuditLog::max_waiting_bytes / 2;

}  // namespace

AuditLog::~AuditLog() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  news_.notify_all();
  if (writer_.joinable()) writer_.join();
  if (file_.is_open()) write_now("stopped", {});
}

/// Tells of the log itself, by the thread that calls.
void AuditLog::write_now(std::string_view event, std::string_view detail) {
  const auto record = format_audit_event({.event = event, .detail = detail}, std::chrono::system_clock::now());
  const auto done = file_.write({&record, 1});
  const std::lock_guard lock(mutex_);
  note_written(done, 1);
  if (!done) put(record);
}

rr::Result<> AuditLog::open(const AuditConfig& config) {
  const std::lock_guard file_lock(file_mutex_);
  const bool is_same = file_.is_open() && file_.config().file == config.file;
  if (is_same) {
    if (auto reopened = file_.reopen(); !reopened) return reopened;
    file_.set_config(config);
  } else if (config.file.empty()) {
    if (file_.is_open()) write_now("stopped", {});
    file_ = AuditFile();
  } else {
    auto opened = AuditFile::open(config);
    if (!opened) return opened.error();
    if (file_.is_open()) write_now("stopped", {});
    file_ = std::move(*opened);
  }
  {
    const std::lock_guard lock(mutex_);
    config_ = config;
    is_used_ = file_.is_open();
    if (!is_same) {
      state_.found = file_.found();
      state_.chain = file_.chain();
    }
  }
  if (is_same || !file_.is_open()) return {};
  write_now("started", file_.found());
  if (!writer_.joinable()) writer_ = std::thread([this] { run(); });
  return {};
}

rr::Result<> AuditLog::reopen() {
  const std::lock_guard file_lock(file_mutex_);
  return file_.is_open() ? file_.reopen() : rr::Result<>();
}

rr::Result<> AuditLog::admit() {
  if (!is_used_) return {};
  const std::lock_guard lock(mutex_);
  if (!config_.fails_closed) return {};
  const bool is_full = waiting_bytes_ > much_waiting;
  if (state_.failure.empty() && !is_full) return {};
  ++state_.refused;
  return rr::make_error(rr::ErrorCode::out_of_system_resource,
                        "the gateway can't write its audit log (" +
                            (is_full ? std::string("the disk is too slow") : state_.failure) +
                            "), and does nothing that it can't record; try again later");
}

void AuditLog::add(const AuditEvent& event) {
  if (!is_used_) return;
  auto record = format_audit_event(event, std::chrono::system_clock::now());
  {
    const std::lock_guard lock(mutex_);
    put(std::move(record));
  }
  news_.notify_one();
}

void AuditLog::put(std::string record) {
  if (waiting_bytes_ + record.size() > max_waiting_bytes) {
    ++state_.lost;
    return;
  }
  waiting_bytes_ += record.size();
  waiting_.push_back(std::move(record));
}

void AuditLog::note_written(const rr::Result<>& result, std::size_t count) {
  const auto now = std::chrono::steady_clock::now();
  if (!result) {
    if (state_.failure.empty()) failing_since_ = now;
    state_.failure = result.error().message;
    return;
  }
  state_.chain = file_.chain();
  state_.records += count;
  const auto lost = state_.lost - std::exchange(lost_before_, state_.lost);
  const auto refused = state_.refused - std::exchange(refused_before_, state_.refused);
  if (state_.failure.empty() && lost == 0) return;
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(now - failing_since_).count();
  const auto why = state_.failure.empty() ? std::string("the disk is too slow")
                                          : state_.failure + " for " + std::to_string(seconds) + " s";
  state_.failure.clear();
  const auto detail =
      why + ": " + std::to_string(lost) + " records were lost, " + std::to_string(refused) + " requests refused";
  put(format_audit_event({.event = "resumed", .detail = detail}, std::chrono::system_clock::now()));
}

void AuditLog::run() {
  std::vector<std::string> batch;  // what could not be written stays in it
  std::unique_lock lock(mutex_);
  for (;;) {
    if (state_.failure.empty())
      news_.wait(lock, [this] { return is_stopping_ || !waiting_.empty(); });
    else
      news_.wait_for(lock, retry_period, [this] { return is_stopping_; });
    std::size_t bytes = 0;
    for (const auto& record : batch) bytes += record.size();
    while (bytes < max_batch_bytes && !waiting_.empty()) {
      bytes += waiting_.front().size();
      batch.push_back(std::move(waiting_.front()));
      waiting_.pop_front();
    }
    if (batch.empty() && is_stopping_) return;
    state_.waiting = batch.size();
    lock.unlock();
    {
      const std::lock_guard file_lock(file_mutex_);
      const auto done = file_.is_open() ? file_.write(batch) : rr::Result<>();
      lock.lock();
      note_written(done, batch.size());
      if (done) {
        waiting_bytes_ -= bytes;
        batch.clear();
      }
      state_.waiting = batch.size();
    }
    if (waiting_.empty() && batch.empty()) idle_.notify_all();
    if (is_stopping_ && !batch.empty()) {
      state_.lost += batch.size() + waiting_.size();
      return;
    }
  }
}

AuditLog::State AuditLog::state() const {
  const std::lock_guard lock(mutex_);
  auto out = state_;
  out.waiting += waiting_.size();
  return out;
}

bool AuditLog::flush(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, time, [this] { return waiting_.empty() && state_.waiting == 0; });
}

}  // namespace rrgate
