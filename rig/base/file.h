#pragma once
// Files that are whole or absent.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace imrig {

// Reads a text file. Throws Error when it cannot be read or is larger than max_bytes.
std::string read_text(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);

// Writes beside the target, flushes to disk, renames over it: a reader sees the old file or the new one. Throws Error.
void write_text_atomically(const std::string& path, std::string_view text);

// Flushes a folder's entries to disk, so that a file just made in it is still there after a crash.
void flush_folder(const std::string& folder);

// FNV-1a over bytes, for telling configurations and data apart (no defence against an adversary).
std::uint64_t fnv1a64(std::string_view bytes, std::uint64_t seed = 14695981039346656037ull);

// Folder of the running executable, for finding its siblings.
std::string executable_folder();

}  // namespace imrig
