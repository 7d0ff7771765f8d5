// Which topics of a bag become what.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bag/survey.hpp"

namespace understory::cli {

/// Topics by name, as the options state them; empty = not stated, "none" = left out.
struct BagTopics {
  std::string cloud, scan, imu, odometry, gnss, truth;
};

/// Places in Bag::topics().
struct BagChoice {
  std::optional<std::size_t> cloud, scan, imu, odometry, gnss, truth;
  std::vector<std::string> remarks;  ///< What is left out and how to get it, one line each.

  /// All that were chosen.
  std::vector<std::size_t> all() const;
};

/// A topic that is the only one of its kind is taken; of several, one must be named. Odometry may
/// be that of wheels or of somebody's SLAM, and a pose is a reference only to who knows it: both
/// are taken by name alone. Beside a cloud no scan is taken. Throws io::DataError naming the option
/// and the candidates.
BagChoice choose_bag_topics(const std::vector<bag::Topic>& topics, const BagTopics& named);

/// What `import` makes of each topic, or how to get it; for --list.
std::vector<std::string> bag_uses(const std::vector<bag::Topic>& topics, const BagTopics& named);

}  // namespace understory::cli
