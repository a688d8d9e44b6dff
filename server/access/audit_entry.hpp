// Something that is done, and its one record. Layer: server/access.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "server/access/audit_log.hpp"

namespace rrgate {

/// Made when something is admitted; written when its outcome is known, or when nobody waits for it any more.
class AuditEntry {
 public:
  /// `event`  the name of the record; a literal. Of `what` all is copied.
  AuditEntry(std::shared_ptr<AuditLog> log, Identity who, const AccessRequest& what, std::string_view event,
             std::string_view trace)
      : log_(std::move(log)),
        who_(std::move(who)),
        device_(what.device),
        service_(what.service),
        path_(what.path),
        member_(what.member),
        verb_(what.verb),
        event_(event),
        trace_(trace) {}
  AuditEntry(const AuditEntry&) = delete;
  AuditEntry& operator=(const AuditEntry&) = delete;
  ~AuditEntry() { finish(Outcome::error, "it ended before it was answered"); }

  /// The first call counts.
  void finish(const rr::Result<>& result) {
    if (result)
      finish(Outcome::ok, {});
    else
      finish(Outcome::error, result.error().message);
  }
  void finish(Outcome outcome, std::string_view detail) {
    if (std::exchange(is_finished_, true)) return;
    const AccessRequest what{device_, service_, path_, member_, verb_};
    log_->add({.event = event_, .who = &who_, .what = &what, .detail = detail, .outcome = outcome, .trace = trace_});
  }

 private:
  std::shared_ptr<AuditLog> log_;
  Identity who_;
  std::string device_, service_, path_, member_;
  Verb verb_;
  std::string_view event_;
  std::string trace_;
  bool is_finished_ = false;
};
/// Null: there is nothing to record.
using AuditEntryPtr = std::shared_ptr<AuditEntry>;

}  // namespace rrgate
