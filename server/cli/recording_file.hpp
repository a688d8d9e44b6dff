// What a recording holds, for people. Layer: server/cli.
#pragma once

#include <string>
#include <vector>

namespace rrgate {

/// Whether a word of the command line is a file and no URL.
bool is_recording_file(const std::string& text);
/// Prints what the files of a recording hold. Returns an exit code.
int print_recording(const std::vector<std::string>& files, bool is_json);

}  // namespace rrgate
