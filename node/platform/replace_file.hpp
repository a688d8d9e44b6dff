// Writing a file anew, as a whole. Layer: node/platform.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace rr {

/// Whoever reads meanwhile finds the old file or the new one whole. No other file beside it is touched.
/// `prepare`  gives the new file, still empty and its owner's alone, the owner and the mode that it is to have; false:
/// it can't.
/// Returns  false: it could not be written, and is what it was.
[[nodiscard]] bool replace_file(const std::filesystem::path& path, std::string_view text,
                                const std::function<bool(int file)>& prepare);

}  // namespace rr
