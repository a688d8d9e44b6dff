// rrgate generate: source code from service definitions. Layer: server/cli.
#include "node/client/client.hpp"
#include "node/generate/generate_cpp.hpp"
#include "node/generate/generate_typescript.hpp"
#include "node/platform/text_file.hpp"
#include "server/cli/command.hpp"
#include "server/cli/diagnostics.hpp"

namespace rrgate {

namespace {

bool is_url(std::string_view operand) {
  return operand.find("://") != std::string_view::npos;
}

/// The definitions that a live service sends to its clients.
DefinitionSet definitions_of_service(const std::string& url) {
  const auto object = rr::connect(url);
  std::vector<std::string> texts;
  for (const auto& definition : object.connection().asynchronous().session().types().definitions())
    texts.push_back(definition->text);
  return DefinitionSet::from_texts(texts, rr::RobdefMode::compat);
}

int write_output(const std::string& file, const std::string& text) {
  if (file.empty()) {
    std::cout << text;
  } else if (!write_text_file(file, text)) {
    std::cerr << file << ": error: cannot be written\n";
    return exit_failed;
  }
  return exit_ok;
}

int generate_ts(const ParsedArguments& parsed, const DefinitionSet& set) {
  const auto option = parsed.options.find("-o");
  const auto out = option == parsed.options.end() ? std::string() : option->second;
  const bool is_module = out.ends_with(".ts") && !out.ends_with(".d.ts");
  return write_output(
      out, generate_typescript(set, is_module ? TypeScriptFlavour::module : TypeScriptFlavour::declarations));
}

/// The files that were named, or all that the service has; a header and a source each.
int generate_cpp_files(const ParsedArguments& parsed, const DefinitionSet& set) {
  const auto option = parsed.options.find("-o");
  const auto folder = std::filesystem::path(option == parsed.options.end() ? "." : option->second);
  std::error_code error;
  std::filesystem::create_directories(folder, error);  // where it fails, writing does
  for (const auto* definition : set.requested()) {
    const auto files = generate_cpp(set, *definition);
    if (write_output((folder / (files.name + ".hpp")).string(), files.header) != exit_ok ||
        write_output((folder / (files.name + ".cpp")).string(), files.source) != exit_ok)
      return exit_failed;
  }
  return exit_ok;
}

}  // namespace

int run_generate(Arguments arguments) {
  constexpr std::string_view options[] = {"-o"};
  constexpr std::string_view flags[] = {"--compat"};
  constexpr std::string_view repeated[] = {"-I"};
  auto parsed = parse_arguments(arguments, {options, flags, repeated});
  if (!parsed.error.empty()) return usage_error("generate", parsed.error);
  if (parsed.operands.size() < 2) return usage_error("generate", "expected a language (ts, cpp) and a FILE or several");
  const auto language = parsed.operands.front();
  if (language != "ts" && language != "cpp")
    return usage_error("generate", "unknown language " + rr::quote(language) + ", expected ts or cpp");
  parsed.operands.erase(parsed.operands.begin());
  const auto urls = std::count_if(parsed.operands.begin(), parsed.operands.end(), is_url);
  if (urls != 0 && parsed.operands.size() != 1) return usage_error("generate", "expected files, or one URL alone");
  try {
    const auto set = urls != 0 ? definitions_of_service(parsed.operands.front())
                               : DefinitionSet::from_files(parsed.operands, parsed.repeated, mode_of(parsed));
    if (!report_diagnostics(set)) return exit_failed;
    return language == "ts" ? generate_ts(parsed, set) : generate_cpp_files(parsed, set);
  } catch (const rr::ClientException& failure) {
    std::cerr << "rrgate generate: " << parsed.operands.front() << ": " << failure.what() << "\n";
    return exit_failed;
  }
}

}  // namespace rrgate
