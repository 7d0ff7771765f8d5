// What a bag holds: rates, frames, clocks, static transforms.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"
#include "common/bag/cloud_decoder.hpp"
#include "common/bag/static_transforms.hpp"

namespace understory::bag {

/// What the messages of a type can become.
enum class Role : std::uint8_t {
  kNone,
  kCloud,       ///< PointCloud2, Livox CustomMsg, packets of a laser.
  kScan,        ///< LaserScan.
  kImu,         ///< Imu, packets of an Ouster's.
  kOdometry,    ///< Odometry; also a pose.
  kTwist,       ///< A velocity alone.
  kGnss,        ///< NavSatFix.
  kPose,        ///< A reference of the pose.
  kTransforms,  ///< Transforms, static ones and others.
};
/// The role of a topic; kNone of types and encodings that are not read.
Role role_of(const Topic& topic);

/// What was found in the messages of one topic.
struct TopicSurvey {
  std::uint64_t messages = 0;
  std::int64_t first_ns = 0;  ///< Received.
  std::int64_t last_ns = 0;
  std::string frame;                    ///< Of the first header.
  double stamp_minus_received_s = 0.0;  ///< Median, of those that have a stamp.
  std::uint64_t without_stamp = 0;      ///< Messages; packets may have none.
  std::string cloud;                    ///< CloudDecoder::description(), of clouds.
  /// Mean of an IMU's first 100 messages, in the unit that it has.
  Eigen::Vector3d force_mps2 = Eigen::Vector3d::Zero();
  std::string fault;  ///< Of the first message that cannot be read; empty = none.

  /// Messages per second; 0 where there are fewer than two.
  double rate_hz() const;
};

/// What was found in all topics that have a role.
struct Survey {
  std::vector<TopicSurvey> topics;  ///< In the order of Bag::topics().
  StaticTransforms transforms;      ///< Of .../tf_static, and those of /tf that do not move.
};

/// Reads the messages of all topics that have a role, their headers alone but for the first clouds.
/// `progress` gets the messages read so far. Throws io::DataError where the container is damaged;
/// messages that cannot be read are noted.
Survey survey(Bag& bag, const CloudOptions& options,
              const std::function<void(std::uint64_t)>& progress = {});

/// A reader of the message, or io::DataError.
MessageReader reader_of(const Bag& bag, const Message& message);

}  // namespace understory::bag
