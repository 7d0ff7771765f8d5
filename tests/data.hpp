// Recordings that tests read.
#pragma once

#include <cstdlib>
#include <filesystem>

#include "tests/skip.hpp"

namespace understory::test {

/// The folder of recordings: $UNDERSTORY_DATA; without it `../shared/data` beside the checkout.
inline std::filesystem::path data_folder() {
  const char* const set = std::getenv("UNDERSTORY_DATA");
  return set != nullptr ? set : UNDERSTORY_DEFAULT_DATA;
}

/// A file or folder of data_folder(). Skips the test case where it does not exist. Cases that call
/// this have the tag [recorded].
inline std::filesystem::path recording(const std::filesystem::path& relative) {
  std::filesystem::path path = data_folder() / relative;
  if (!std::filesystem::exists(path)) skip("there is no " + path.lexically_normal().string());
  return path;
}

}  // namespace understory::test
