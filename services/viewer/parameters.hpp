// What the viewer may be told.
#pragma once

#include "services/viewer/page_host.hpp"

namespace understory::viewer {

/// Of the process.
struct ViewerParameters {
  PageParameters page;
  int niceness = 10;              ///< Of the process: people wait for a page, vehicles for poses.
  bool hears_sweeps = false;      ///< Joins the group of the sweeps.
  bool watches_processes = true;  ///< All processes run on this computer.
};

}  // namespace understory::viewer
