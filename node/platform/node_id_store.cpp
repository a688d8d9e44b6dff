#include "node/platform/node_id_store.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "core/support/random.hpp"
#include "core/support/words.hpp"
#include "node/platform/folders.hpp"

namespace rr {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t max_file_size = 16384;

Result<> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return make_error(ErrorCode::system_resource_error, "create " + folder.string() + ": " + error.message());
  return {};
}

/// Root's own file is looked for where an administrator puts it first.
Result<fs::path> id_file(std::string_view name) {
  const auto config = user_config_folder();
  if (!config) return config;
  const auto file = *config / "nodeids" / name;
  if (::geteuid() != 0 || fs::exists(file)) return file;
  const auto state = system_state_folder();
  if (!state) return state;
  return *state / "nodeids" / name;
}

}  // namespace

Result<NodeIdClaim> NodeIdClaim::take(std::string_view name) {
  if (!is_valid_node_name(name))
    return make_error(ErrorCode::invalid_argument, rr::quote(name) + " is not a node name");
  const auto run = make_user_run_folder();
  if (!run) return run.error();
  if (auto made = make_folder(*run / "nodeids"); !made) return made.error();
  auto lock = LockedFile::open(*run / "nodeids" / (std::string(name) + ".pid"));
  if (!lock) return lock.error();
  if (auto written = lock->write(std::to_string(::getpid())); !written) return written.error();

  const auto file = id_file(name);
  if (!file) return file.error();
  std::string text(max_file_size + 1, '\0');
  std::ifstream stored(*file, std::ios::binary);
  stored.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(stored.gcount(), 0)));
  if (text.empty() || text.size() > max_file_size) {
    const NodeId id = random_node_id();
    if (auto made = make_folder(file->parent_path()); !made) return made.error();
    std::ofstream out(*file, std::ios::binary | std::ios::trunc);
    out << format_node_id(id) << std::flush;
    if (!out) return make_error(ErrorCode::system_resource_error, "write " + file->string());
    return NodeIdClaim(id, std::move(*lock));
  }
  const auto id = parse_node_id(trim(text, " \t\r\n"));
  if (!id || id->is_any())
    return make_error(ErrorCode::invalid_configuration,
                      file->string() + " holds " + rr::quote(text) + ", expected the NodeID of " + rr::quote(name));
  return NodeIdClaim(*id, std::move(*lock));
}

}  // namespace rr
