// The page's files, which are part of the program.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace understory::viewer {

/// One file of the page.
struct PageFile {
  std::string path;  ///< As in the request.
  std::string content_type;
  std::string_view content;
};

/// All of them; where the page was not built (no npm), a page that says so.
std::span<const PageFile> page_files();
/// Whether the page was built.
bool has_page();

}  // namespace understory::viewer
