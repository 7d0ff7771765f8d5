#include "common/bus/noise_parameters.hpp"

namespace understory::bus {

void describe(model::DetectionNoiseParameters& p, ParameterTable& table) {
  table.add("noise.learn", p.learn,
            "Learn from scan to scan by which factor the variances of LANDMARKS are wrong.");
  table.add("noise.replace_above", p.replace_above, {1.0, 1000.0}, "",
            "Learned factor of the variance from which it is used.");
  table.add("noise.replace_below", p.replace_below, {0.0, 1.0}, "",
            "Learned factor of the variance below which it is used. Larger ones are taken for "
            "errors that consecutive scans have in common.");
  table.add("noise.replace_corners_below", p.replace_corners_below, {0.0, 1.0}, "",
            "The same of corners. A wall is flat; the level's error, which all corners of a scan "
            "share, is no noise of each.");
}

}  // namespace understory::bus
