// rrgate generate: source code from service definitions. Layer: server/cli.
#include "node/client/client.hpp"
#include "node/generate/generate_cpp.hpp"
#include "node/generate/generate_typescript.hpp"
#include "node/platform/text_file.hpp"
#include "server/cli/definition_options.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

bool is_url(std::string_view operand) {
  return operand.find("://") != std::string_view::npos;
}

/// The definitions that a live service sends to its clients.
DefinitionSet definitions_of_service(const std::string& url) {
  const auto object = open_service(remote_address({.url = url}));
  std::vector<std::string> texts;
  for (const auto& definition : object.connection().asynchronous().session().types().definitions())
    texts.push_back(definition->text);
  return DefinitionSet::from_texts(texts, rr::RobdefMode::compat);
}

int write_output(const std::string& file, const std::string& text, bool is_json) {
  if (file.empty() && is_json) {
    print_json_line({{"text", text}});
  } else if (file.empty()) {
    std::cout << text;
  } else if (!write_text_file(file, text)) {
    std::cerr << file << ": error: cannot be written\n";
    return exit_failed;
  } else if (is_json) {
    print_json_line({{"file", file}});
  }
  return exit_ok;
}

struct GenerateOptions : DefinitionOptions {
  std::string output;
  bool is_json = false;
};

int generate_ts(const GenerateOptions& options, const DefinitionSet& set) {
  const bool is_module = options.output.ends_with(".ts") && !options.output.ends_with(".d.ts");
  const auto flavour = is_module ? TypeScriptFlavour::module : TypeScriptFlavour::declarations;
  return write_output(options.output, generate_typescript(set, flavour), options.is_json);
}

/// The files that were named, or all that the service has; a header and a source each.
int generate_cpp_files(const GenerateOptions& options, const DefinitionSet& set) {
  const auto folder = std::filesystem::path(options.output.empty() ? "." : options.output);
  std::error_code error;
  std::filesystem::create_directories(folder, error);  // where it fails, writing does
  for (const auto* definition : set.requested()) {
    const auto files = generate_cpp(set, *definition);
    if (write_output((folder / (files.name + ".hpp")).string(), files.header, options.is_json) != exit_ok ||
        write_output((folder / (files.name + ".cpp")).string(), files.source, options.is_json) != exit_ok)
      return exit_failed;
  }
  return exit_ok;
}

template <int (*generate)(const GenerateOptions&, const DefinitionSet&)>
int run_generator(const GenerateOptions& options) {
  const auto urls = std::count_if(options.files.begin(), options.files.end(), is_url);
  if (urls != 0 && options.files.size() != 1) return usage_error("generate", "expected files, or one URL alone");
  try {
    const auto set = urls != 0 ? definitions_of_service(options.files.front())
                               : DefinitionSet::from_files(options.files, options.folders, options.mode());
    return report_diagnostics(set) ? generate(options, set) : static_cast<int>(exit_failed);
  } catch (const rr::ClientException& failure) {
    return report_failure("generate", options.files.front() + ": " + failure.what());
  } catch (const NotUnderstood& failure) {
    return usage_error("generate", options.files.front() + ": " + failure.what());
  }
}

void add_generator(const NewCommand<GenerateOptions>& command, const std::string& output) {
  command.app
      .add_option("FILE", command.values.files,
                  "Service definitions, - for standard input, or the URL of a service that has them")
      ->required()
      ->option_text("... or URL");
  command.app.add_option("-o", command.values.output, output)->option_text("OUT");
  command.app.add_flag("--json", command.values.is_json, "Print each file that is written as one line of JSON");
  add_folders(command.app, command.values);
  add_compat(command.app, command.values);
}

}  // namespace

void add_generate(Commands& commands) {
  auto& group = commands.add_group("generate", "Write TypeScript types or C++ classes");
  add_generator(commands.add("ts", "TypeScript types of the objects", run_generator<generate_ts>, &group),
                "File to write; default: standard output");
  add_generator(commands.add("cpp", "C++ classes for clients and services", run_generator<generate_cpp_files>, &group),
                "Folder to write to; this one without it");
}

}  // namespace rrgate
