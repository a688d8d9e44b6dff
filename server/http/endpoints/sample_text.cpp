#include "server/http/endpoints/sample_text.hpp"

#include "server/http/endpoints/member_values.hpp"

namespace rrgate {

const rr::Result<std::string>& sample_text(const Sample& sample, const rr::MemberDefinition& member,
                                           const rr::TypeRegistry& types, const rr::JsonForm& form,
                                           MemoryBudget& memory) {
  if (!sample.texts) sample.texts = std::make_shared<SampleTexts>(memory.charge(""));
  auto& [texts, charge] = *sample.texts;
  for (const auto& known : texts)
    if (known.member == &member && known.form == form) return known.json;
  const auto json = sample_to_json(sample, member, types, form);
  texts.push_back({&member, form, json ? rr::Result<std::string>(rr::write_json(*json)) : json.error()});
  const auto& made = texts.back().json;
  if (made) charge.hold(charge.bytes() + made->size());
  return made;
}

}  // namespace rrgate
