#include "core/robdef/parse/constant_check.hpp"

#include "core/robdef/model/constant_value.hpp"

namespace rr {

bool check_constant(StatementReader& reader, const ConstantDefinition& constant, const ConstantPlace& at) {
  std::vector<ConstantIssue> issues;
  read_constant_value(constant.type, constant.value_text, issues);
  bool is_good = true;
  for (const auto& issue : issues) {
    const bool is_about_type = issue.from == 0 && issue.to == 0;
    const auto span = is_about_type ? reader.span(at.type_start, at.type_end)
                                    : reader.span(at.value_start + issue.from, at.value_start + issue.to);
    auto message = "constant " + quote(constant.name) + ": " + issue.message;
    if (issue.is_relaxed) {
      reader.reporter().relaxed(issue.code, span, std::move(message));
    } else {
      reader.reporter().error(issue.code, span, std::move(message));
      is_good = false;
    }
  }
  if (is_good && (constant.type.type == DataType::int8_t || constant.type.type == DataType::uint8_t)) {
    reader.reporter().warning("interop", reader.span(at.type_start, at.type_end),
                              "constant " + quote(constant.name) +
                                  ": existing peers read 8-bit constants as characters; prefer a wider type");
  }
  return is_good;
}

}  // namespace rr
