// The page's files, compiled into the program.
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

/// All files; if the page was not built (no npm), a page with that information.
std::span<const PageFile> page_files();
/// Whether the page was built.
bool has_page();

}  // namespace understory::viewer
