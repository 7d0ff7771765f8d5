// The store's parameters. Ranges and the texts of --help are in adapter_parameters.cpp.
#pragma once

#include <string>

namespace understory::submap_store {

/// The folder, and in which of its files a drive continues.
struct FolderParameters {
  std::string folder;              ///< Empty: `maps` in the process's state directory.
  double go_on_within_s = 600.0;   ///< Message time since the last input of the file's drive.
  double seal_within_s = 0.6;      ///< Time for sealing when the process is stopped.
  double rows_sealed_per_s = 2e4;  ///< Landmarks and keyframes sealed per second.
};

/// Periods and rates of writing.
struct WritingParameters {
  double ground_period_s = 10.0;   ///< Message time between writes of the ground.
  int moved_landmarks_per_s = 20;  ///< Of the ground, rewritten per second of message time.
  int submaps_per_s = 10;          ///< Corrected submaps drawn per second of message time.
};

/// Size limits of messages.
struct StoreInputParameters {
  int max_landmarks = 2000;         ///< Of a SUBMAP.
  int max_map_landmarks = 1000000;  ///< Of a MAP or MAP_DELTA.
};

/// Parameters of the process.
struct StoreParameters {
  FolderParameters file;
  WritingParameters writing;
  StoreInputParameters input;
};

}  // namespace understory::submap_store
