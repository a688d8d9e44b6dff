// rrgate get, set, call: single values of a device. Layer: server/cli.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "node/platform/text_file.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/remote_service.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/json/arguments.hpp"
#include "server/json/value_from_json.hpp"

namespace rrgate {

namespace {

using enum rr::MemberKind;

struct ValueOptions : RemoteOptions {
  std::string_view command;
  std::vector<rr::MemberKind> kinds;  ///< that it is for
  std::string member;
  std::string value;                 ///< of set
  CLI::Option* arguments = nullptr;  ///< of call; their texts as they are
  std::string output;                ///< of get and call: a file
};

bool is_image_name(const std::string& file) {
  return file.ends_with(".png") || file.ends_with(".jpg") || file.ends_with(".jpeg");
}

bool can_write(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path path(file);
  if (fs::exists(path, error)) return !fs::is_directory(path, error) && ::eaccess(file.c_str(), W_OK) == 0;
  const auto folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  return path.has_filename() && ::eaccess(folder.c_str(), W_OK | X_OK) == 0;
}

/// Before the device does anything. Throws   std::runtime_error: the file can't be written.
void expect_writable(const std::string& file) {
  if (!file.empty() && !can_write(file)) throw std::runtime_error(file + ": can't be written");
}

/// The same. Throws   NotUnderstood, too: the file's name is an image's, and the value none.
void check_output(const rr::TypeDefinition& type, const rr::TypeRegistry& types, const ValueOptions& options) {
  if (is_image_name(options.output) && !is_image_type(type, types))
    throw NotUnderstood("its value is no image: " + rr::format_type(type));
  expect_writable(options.output);
}

/// To the terminal, or to the file that --output names.
void deliver(const rr::Value& value, const rr::TypeDefinition& type, const rr::TypeRegistry& types,
             const ValueOptions& options) {
  const auto& file = options.output;
  if (file.empty()) return print_value(to_json(value, type, types), options.is_json);
  std::string content;
  if (is_image_name(file)) {
    const auto work = prepare_image(value, type, types, file.ends_with(".png") ? png_type : jpeg_type);
    auto image = work ? encode_image(*work) : work.error();
    if (!image) throw rr::ClientException(image.error());
    content = std::move(*image);
  } else {
    content = rr::write_json(to_json(value, type, types)) + "\n";
  }
  if (!write_text_file(file, content)) throw std::runtime_error(file + ": can't be written");
}

/// The same for many values: a file gets a line for each as it comes. One that is there stays as it is until then.
class ValueSink {
 public:
  /// Throws   NotUnderstood; std::runtime_error: the file can't be written.
  explicit ValueSink(const ValueOptions& options) : options_(options) {
    if (is_image_name(options.output))
      throw NotUnderstood(rr::quote(options.member) + " is a generator: " + options.output +
                          " would hold one of its values; a file with another ending gets a line of JSON for each");
    expect_writable(options.output);
  }

  void deliver(const rr::Value& value, const rr::TypeDefinition& type, const rr::TypeRegistry& types) {
    if (options_.output.empty()) return print_value(to_json(value, type, types), options_.is_json);
    open();
    file_ << rr::write_json(to_json(value, type, types)) << std::endl;
    check();
  }

  /// After the last value: without any, the file is empty.
  void finish() {
    if (!options_.output.empty()) open();
  }

 private:
  void open() {
    if (!file_.is_open()) file_.open(options_.output, std::ios::binary | std::ios::trunc);
    check();
  }

  void check() const {
    if (!file_) throw std::runtime_error(options_.output + ": can't be written");
  }

  const ValueOptions& options_;
  std::ofstream file_;
};

/// Waits for a request, as BlockingConnection::wait_for(), and shows how much has passed meanwhile.
template <class Start>
rr::Value wait_showing_bytes(const rr::RemoteObject& object, const Start& start) {
  auto& connection = object.connection();
  const auto passed = [&connection] {
    const auto& stats = connection.asynchronous().session().connection().stats();
    return stats.bytes_received + stats.bytes_sent;
  };
  Progress progress("transferring");
  const auto before = passed();
  std::optional<rr::Result<rr::Value>> answer;
  start(connection.asynchronous(), [&answer](rr::Result<rr::Value> result) { answer = std::move(result); });
  const auto is_done = [&answer] { return answer.has_value(); };
  constexpr std::uint64_t little = 100'000;  // it is not the transfer that takes its time
  while (!connection.run_until(is_done, std::chrono::milliseconds(100)))
    if (const auto bytes = passed() - before; bytes > little) progress.show(bytes);
  if (!*answer) throw rr::ClientException(answer->error());
  return std::move(**answer);
}

/// All of it.
rr::Value read_memory(const rr::RemoteObject& object, const std::string& name) {
  const auto count = object.memory(name).dimensions();
  const rr::MemoryShape position(count.size(), 0);
  return wait_showing_bytes(object, [&](auto& connection, auto done) {
    connection.read_memory(object.path(), name, {position, count}, std::move(done));
  });
}

void get_value(const RemoteMember& found, const ValueOptions& options) {
  const auto& name = found.member->name;
  check_output(found.member->type, found.types(), options);
  rr::Value value;
  if (found.member->kind == memory)
    value = read_memory(found.object, name);
  else if (found.member->kind == wire)
    value = found.object.peek_in(name);
  else
    value = wait_showing_bytes(
        found.object, [&](auto& connection, auto done) { connection.get(found.object.path(), name, std::move(done)); });
  deliver(value, found.member->type, found.types(), options);
}

void set_value(const RemoteMember& found, const ValueOptions& options) {
  const auto& member = *found.member;
  const auto value =
      rr::value_from_json(read_json_argument(options.value, member.type), member.type, found.types(), {}, member.name);
  if (!value) throw NotUnderstood(value.error().message);
  if (member.kind == property)
    wait_showing_bytes(found.object, [&](auto& connection, auto done) {
      connection.set(found.object.path(), member.name, *value, std::move(done));
    });
  else
    found.object.poke_out(member.name, *value);
  if (options.is_json) print_value(to_json(*value, member.type, found.types()), true);
}

std::string signature(const rr::MemberDefinition& function) {
  std::string out = function.name + "(";
  for (const auto& parameter : function.parameters) {
    if (out.back() != '(') out += ", ";
    out += rr::format_type(parameter.type) + " " + parameter.name;
  }
  return out + ")";
}

/// By name ("radius=5000"); the others, in order, are those that no name was given for.
std::vector<rr::Value> read_arguments(const RemoteMember& found, const std::vector<std::string>& texts) {
  const auto& parameters = found.member->parameters;
  auto json = rr::Json::object();
  std::vector<std::string_view> unnamed;
  for (const auto& text : texts) {
    const auto name = text.substr(0, text.find('='));
    const auto is_it = [&](const auto& parameter) { return name != text && parameter.name == name; };
    const auto parameter = std::find_if(parameters.begin(), parameters.end(), is_it);
    if (parameter == parameters.end()) {
      unnamed.push_back(text);
      continue;
    }
    if (json.contains(name)) throw NotUnderstood("argument " + rr::quote(name) + " is given twice");
    json[name] = read_json_argument(std::string_view(text).substr(name.size() + 1), parameter->type);
  }
  auto next = unnamed.begin();
  for (const auto& parameter : parameters)
    if (next != unnamed.end() && !json.contains(parameter.name))
      json[parameter.name] = read_json_argument(*next++, parameter.type);
  if (next != unnamed.end())
    throw NotUnderstood(std::to_string(texts.size()) + " arguments for " + signature(*found.member));
  auto values = rr::arguments_from_json(json, *found.member, found.types(), {});
  if (!values) throw NotUnderstood(values.error().message + "; it is " + signature(*found.member));
  return std::move(*values);
}

void call_function(const RemoteMember& found, const ValueOptions& options) {
  const auto& member = *found.member;
  if (member.step_parameter())
    throw NotUnderstood(rr::quote(member.name) + " takes values while it runs, which this command can't give");
  const auto values = read_arguments(found, options.arguments->results());
  auto type = member.type;
  if (member.is_generator()) {
    type.container = rr::ContainerKind::none;
    ValueSink sink(options);
    auto generator = found.object.generator_values(member.name, values);
    for (const auto& value : generator) sink.deliver(value, type, found.types());
    return sink.finish();
  }
  check_output(type, found.types(), options);
  const auto result = wait_showing_bytes(found.object, [&](auto& connection, auto done) {
    connection.call(found.object.path(), member.name, values, std::move(done));
  });
  if (type.type != rr::DataType::void_t) deliver(result, type, found.types(), options);
}

template <void (*use)(const RemoteMember&, const ValueOptions&)>
int run_with_member(const ValueOptions& options) {
  return run_remote(options.command, options.url, [&] {
    const auto found = find_member(open_service(remote_address(options)), options.member);
    expect_kind(found, options.kinds, options.command);
    use(found, options);
  });
}

/// What get, set and call have alike.
NewCommand<ValueOptions> add_member_command(Commands& commands, const char* name, std::vector<rr::MemberKind> kinds,
                                            const std::string& summary, int (*run)(const ValueOptions&)) {
  const auto command = commands.add(name, summary, run);
  auto& [app, options] = command;
  options.command = name;
  options.kinds = std::move(kinds);
  add_url(app, options)->required();
  app.add_option("MEMBER", options.member, "\"position\", or through objrefs \"axes/0/position\"")
      ->required()
      ->option_text(" ");
  add_connection_options(app, options);
  return command;
}

/// What get and call do with a value.
void add_output_options(CLI::App& app, ValueOptions& options) {
  add_json(app, options);
  app.add_option(
         "--output,-o", options.output,
         "Write to a file: as an image if the name ends in .png or .jpg, otherwise as JSON, one line for each value")
      ->option_text("FILE");
}

}  // namespace

void add_get(Commands& commands) {
  const auto [app, options] =
      add_member_command(commands, "get", {property, wire, memory}, "Print a property, a wire's newest value, a memory",
                         run_with_member<get_value>);
  add_output_options(app, options);
}

void add_set(Commands& commands) {
  const auto [app, options] =
      add_member_command(commands, "set", {property, wire}, "Write a property or a wire", run_with_member<set_value>);
  app.add_option("VALUE", options.value, "JSON; @FILE, or - for standard input")->required()->option_text(" ");
  add_json(app, options)->description("Print the value that was written, as one line of JSON");
}

void add_call(Commands& commands) {
  const auto [app, options] = add_member_command(
      commands, "call", {function}, "Call a function and print what it returns", run_with_member<call_function>);
  // Each argument as it is: a list of words with "extra arguments" would take "[1,2]" for two of them.
  auto* const arguments = app.add_option("ARGUMENT", "JSON in the order of the parameters, or NAME=JSON; @FILE, -");
  arguments->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)->option_text("...");
  app.preparse_callback([arguments](std::size_t words) { arguments->expected(std::max(1, static_cast<int>(words))); });
  options.arguments = arguments;
  add_output_options(app, options);
}

}  // namespace rrgate
