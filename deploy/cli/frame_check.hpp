// Checks by landmarks that two maps have one frame.
#pragma once

#include <string>
#include <vector>

#include "common/map_file/map_file.hpp"
#include "common/model/map.hpp"

namespace understory::cli {

/// The landmarks of maps in one frame.
struct MapsInFrame {
  std::string source;  ///< Name of the file for messages.
  std::vector<std::vector<model::MapLandmark>> maps;
};

/// All maps of a file.
MapsInFrame maps_in(const map_file::MapFile& file);

/// Ends the command with numbers unless a map of one has landmarks at the positions of landmarks of
/// a map of the other, by the limits of `map merge` for a stated relative pose. Linear in the
/// landmarks, for each pair of maps.
void require_one_frame(const MapsInFrame& first, const MapsInFrame& second);

}  // namespace understory::cli
