// A sample as text of JSON: written once, for all who listen. Layer: server/http/endpoints.
#pragma once

#include <deque>
#include <string>

#include "server/json/value_to_json.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/upstream/value_client.hpp"

namespace rrgate {

/// The texts of one sample: one for each form that somebody has asked for, and each definition of its member, as a
/// device may have come back with another one.
struct SampleTexts {
  struct Text {
    const rr::MemberDefinition* member;
    rr::JsonForm form;
    rr::Result<std::string> json;
  };

  explicit SampleTexts(MemoryBudget::Charge charge) : memory(std::move(charge)) {}

  std::deque<Text> texts;
  MemoryBudget::Charge memory;  ///< of the texts
};

/// What the sample says, a value or an event's arguments by name, as text. Whoever asks first for a form writes it; it
/// is kept with the sample (of events and packets while they are handed out only) and borrowed from it.
/// Errors   those of sample_to_json().
const rr::Result<std::string>& sample_text(const Sample& sample, const rr::MemberDefinition& member,
                                           const rr::TypeRegistry& types, const rr::JsonForm& form,
                                           MemoryBudget& memory);

}  // namespace rrgate
