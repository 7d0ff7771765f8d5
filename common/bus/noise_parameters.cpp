#include "common/bus/noise_parameters.hpp"

namespace understory::bus {

void describe(model::DetectionNoiseParameters& p, ParameterTable& table) {
  table.add("noise.learn", p.learn,
            "Learn from scan to scan the factor by which the variances of LANDMARKS are wrong.");
  table.add("noise.replace_above", p.replace_above, {1.0, 1000.0}, "",
            "Learned factors of the variance above this are applied.");
  table.add("noise.replace_below", p.replace_below, {0.0, 1.0}, "",
            "Learned factors of the variance below this are applied. Larger ones are taken for "
            "errors that consecutive scans share.");
  table.add("noise.replace_corners_below", p.replace_corners_below, {0.0, 1.0}, "",
            "The same for corners. Walls are flat, and the level's error is common to all corners "
            "of a scan.");
}

}  // namespace understory::bus
