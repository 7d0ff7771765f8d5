// Parameters of the viewer.
#pragma once

#include "services/viewer/page_host.hpp"

namespace understory::viewer {

/// Of the process.
struct ViewerParameters {
  PageParameters page;
  int niceness = 10;  ///< Of the process: poses for the vehicle have priority over the page.
  bool hears_sweeps = false;      ///< Joins the group of the sweeps.
  bool watches_processes = true;  ///< All processes run on this computer.
};

}  // namespace understory::viewer
