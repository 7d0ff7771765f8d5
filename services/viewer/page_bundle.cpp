#include "services/viewer/page_bundle.hpp"

#include <array>

// Symbols of page_files.S: the built files, and the end of each.
extern "C" {
extern const char understory_page_index[];
extern const char understory_page_index_end[];
extern const char understory_page_script[];
extern const char understory_page_script_end[];
extern const char understory_page_style[];
extern const char understory_page_style_end[];
}

namespace understory::viewer {
namespace {

std::string_view between(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace

std::span<const PageFile> page_files() {
  static const std::string_view index = between(understory_page_index, understory_page_index_end);
  static const std::array<PageFile, 4> files = {
      {{"/", "text/html; charset=utf-8", index},
       {"/index.html", "text/html; charset=utf-8", index},
       {"/app.js", "text/javascript; charset=utf-8",
        between(understory_page_script, understory_page_script_end)},
       {"/app.css", "text/css; charset=utf-8",
        between(understory_page_style, understory_page_style_end)}}};
  return files;
}

bool has_page() { return !between(understory_page_script, understory_page_script_end).empty(); }

}  // namespace understory::viewer
