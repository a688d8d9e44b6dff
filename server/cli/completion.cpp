// rrgate completion: what shells ask while a command is typed. Layer: server/cli.
//
// The shells' scripts are a few lines: they hand the words to "rrgate completion words", which knows the commands and
// asks devices for their members.
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/cli/ls.hpp"
#include "server/cli/remote_service.hpp"
#include "server/cli/stored_logins.hpp"

namespace rrgate {

namespace {

constexpr double patience = 2;  // for a device, in s: somebody waits at a prompt

// What it prints begins with what was typed. Nothing: the shell offers files.
constexpr std::string_view bash_script = R"(_rrgate() {
    local line=${COMP_LINE:0:COMP_POINT} words=() part=${COMP_WORDS[COMP_CWORD]} before='' candidate
    read -ra words <<<"$line"
    [[ $line == *[[:space:]] ]] && words+=("")
    words=("${words[@]//[\'\"\\]/}")
    # Where no quote is open, bash replaces only the last part of words with ":" or "=" in them, and "&" needs a "\".
    local is_quoted=
    if [[ $part == [\'\"]* ]]; then is_quoted=yes; else part=${part//[:=\\]/} before=${words[-1]}; fi
    before=${before%"$part"}
    COMPREPLY=()
    while IFS= read -r candidate; do
        candidate=${candidate#"$before"}
        if [[ ! $is_quoted && $candidate ]]; then printf -v candidate %q "$candidate"; fi
        COMPREPLY+=("$candidate")
    done < <(rrgate completion words -- "${words[@]:1}" 2>/dev/null)
}
complete -o default -F _rrgate rrgate
)";
constexpr std::string_view zsh_script = R"(#compdef rrgate
_rrgate() {
    local -a candidates
    candidates=("${(@f)$(rrgate completion words -- "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}")
    if [[ -n $candidates[1] ]]; then compadd -- "${(@)candidates}"; else _files; fi
}
if [[ $funcstack[1] == _rrgate ]]; then _rrgate "$@"; else compdef _rrgate rrgate; fi
)";
constexpr std::string_view fish_script = R"(function __rrgate_words
    set -l words (commandline -opc) (commandline -ct)
    set -l found (rrgate completion words -- (string unescape -- $words[2..-1]) 2>/dev/null)
    # Of a URL, fish itself would offer files for what comes after ":".
    if set -q found[1]
        printf '%s\n' $found
    else
        __fish_complete_path $words[-1]
    end
end
complete -c rrgate -f -a '(__rrgate_words)'
)";

/// Kinds of member that a command is for; empty: all.
std::vector<rr::MemberKind> kinds_of(std::string_view command) {
  using enum rr::MemberKind;
  if (command == "get") return {property, wire, memory};
  if (command == "set") return {property, wire};
  if (command == "call") return {function};
  if (command == "watch") return {wire, pipe, event};
  if (command == "bench") return {property};
  return {};
}

/// Members of the objects up to the last "/", and objrefs, which lead to others.
std::vector<std::string> members_of(const std::string& url, std::string_view typed, std::string_view command) {
  const auto slash = typed.rfind('/');
  const auto prefix = std::string(typed.substr(0, slash == std::string_view::npos ? 0 : slash + 1));
  RemoteOptions options;
  options.url = url;
  options.timeout = patience;
  const auto kinds = kinds_of(command);
  std::vector<std::string> out;
  const auto found = find_member(open_service(remote_address(options)),
                                 prefix.empty() ? "" : std::string_view(prefix).substr(0, prefix.size() - 1));
  for (const auto& member : found.type->members) {
    if (command == "watch" && member.direction() == rr::MemberDirection::writeonly) continue;
    const bool is_objref = member.kind == rr::MemberKind::objref;
    if (is_objref || kinds.empty() || std::find(kinds.begin(), kinds.end(), member.kind) != kinds.end())
      out.push_back(prefix + member.name + (is_objref ? "/" : ""));
  }
  return out;
}

/// Parameters of a function that are not given yet, as "NAME=".
std::vector<std::string> parameters_of(const std::string& url, const std::string& function) {
  RemoteOptions options;
  options.url = url;
  options.timeout = patience;
  const auto found = find_member(open_service(remote_address(options)), function);
  std::vector<std::string> out;
  if (found.member)
    for (const auto& parameter : found.member->parameters) out.push_back(parameter.name + "=");
  return out;
}

/// Gateways, as far as their services follow.
std::vector<std::string> known_gateways() {
  std::vector<std::string> out;
  try {
    out = gateways_of_stored_logins();
  } catch (const NotUnderstood&) {  // a command that needs the file says what is wrong with it
  }
  for (auto& each : out) each += "/";
  return out;
}

/// Services around here, and gateways that there are logins for; of a gateway whose host and port are typed, up to the
/// "/" behind them, the services of its devices.
std::vector<std::string> urls_of(const std::string& typed) {
  const auto host = typed.starts_with("http") ? typed.find("://") : std::string::npos;
  if (host != std::string::npos && typed.find('/', host + 3) != std::string::npos) {
    RemoteOptions gateway;
    gateway.url = gateway_base(typed.substr(0, typed.rfind('/') + 1));
    gateway.timeout = patience;
    return list_service_urls(gateway, "");
  }
  auto out = known_gateways();
  if (host == std::string::npos)
    for (auto& each : find_service_urls(std::chrono::seconds(1))) out.push_back(std::move(each));
  return out;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> out;
  for (const auto* option : app.get_options())
    for (const auto& name : option->get_lnames()) out.push_back("--" + name);
  return out;
}

/// Whether the word is an option that takes a value.
bool takes_value(const CLI::App& app, const std::string& word) {
  const auto* option = word.starts_with('-') ? app.get_option_no_throw(word) : nullptr;
  return option && option->get_items_expected_max() > 0;
}

std::vector<const CLI::App*> commands_below(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

const CLI::App* find_command(const CLI::App& app, const std::string& name) {
  for (const auto* each : commands_below(app))
    if (each->get_name() == name) return each;
  return nullptr;
}

/// `words`  after the program's name; the last one is being typed.
std::vector<std::string> candidates(const CLI::App& program, std::vector<std::string> words) {
  const auto typed = words.back();
  words.pop_back();
  const auto* app = &program;
  std::vector<std::string> operands;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (const auto* below = find_command(*app, words[i]); below && operands.empty())
      app = below;
    else if (takes_value(*app, words[i]))
      ++i;
    else if (!words[i].starts_with('-'))
      operands.push_back(words[i]);
  }
  if (!words.empty() && takes_value(*app, words.back())) return {};
  if (typed.starts_with('-')) return options_of(*app);
  std::vector<std::string> names;
  for (const auto* each : commands_below(*app)) names.push_back(each->get_name());
  if (!names.empty()) return names;
  // Which operand comes next is what its name says.
  for (const auto* option : app->get_options())
    if (option->get_positional()) names.push_back(option->get_name(true));
  if (names.empty()) return {};
  const auto& next = names[std::min(operands.size(), names.size() - 1)];
  if (next == "ARGUMENT") return parameters_of(operands[0], operands[1]);
  const bool is_member = next == "MEMBER" || next == "OBJECT" || next == "PROPERTY";
  if (is_member && !operands.empty()) return members_of(operands[0], typed, app->get_name());
  if (next == "URL") return urls_of(typed);
  if (next == "GATEWAY") return known_gateways();
  return {};
}

struct CompletionOptions {
  const CLI::App* program = nullptr;
  std::string shell;
  std::vector<std::string> words;
  bool is_json = false;
};

std::string_view script_of(std::string_view shell) {
  if (shell == "bash") return bash_script;
  return shell == "zsh" ? zsh_script : fish_script;
}

int complete(const CompletionOptions& options) {
  if (options.shell != "words") {
    if (options.is_json)
      print_json_line({{"shell", options.shell}, {"script", script_of(options.shell)}});
    else
      std::cout << script_of(options.shell);
    return exit_ok;
  }
  if (options.words.empty()) return exit_ok;
  auto found = nlohmann::ordered_json::array();
  try {
    for (const auto& each : candidates(*options.program, options.words))
      if (each.starts_with(options.words.back())) found.push_back(each);
  } catch (const std::exception&) {
    return exit_failed;  // whoever types sees no candidates; the command itself will tell why
  }
  if (options.is_json)
    print_json_line({{"words", found}});
  else
    for (const auto& each : found) std::cout << each.get_ref<const std::string&>() << "\n";
  return exit_ok;
}

}  // namespace

void add_completion(Commands& commands) {
  const auto [app, options] = commands.add("completion", "Print a completion script for a shell", complete);
  options.program = &commands.app();
  app.add_option("SHELL", options.shell, "bash, zsh or fish; \"words\" prints the completions of the last WORD")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish", "words"}))
      ->option_text(" ");
  app.add_option("WORD", options.words, "Words of a command line, after --")->option_text("...");
  app.add_flag("--json", options.is_json, "Print the script, or the completions, as one line of JSON");
  app.footer("For bash: source <(rrgate completion bash)\n\n" + std::string(exit_codes));
}

}  // namespace rrgate
