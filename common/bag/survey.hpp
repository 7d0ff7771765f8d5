// Contents of a bag: rates, frames, clocks, static transforms.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"
#include "common/bag/cloud_decoder.hpp"
#include "common/bag/static_transforms.hpp"

namespace understory::bag {

/// Use of a type's messages.
enum class Role : std::uint8_t {
  kNone,
  kCloud,       ///< PointCloud2, Livox CustomMsg, packets of a laser.
  kScan,        ///< LaserScan.
  kImu,         ///< Imu, packets of an Ouster's.
  kOdometry,    ///< Odometry; usable as a pose too.
  kTwist,       ///< Velocity only.
  kGnss,        ///< NavSatFix.
  kPose,        ///< Reference poses.
  kTransforms,  ///< Static and other transforms.
};
/// The role of a topic; kNone of types and encodings that are not read.
Role role_of(const Topic& topic);

/// Summary of the messages of one topic.
struct TopicSurvey {
  std::uint64_t messages = 0;
  std::int64_t first_ns = 0;  ///< Reception time of the first message.
  std::int64_t last_ns = 0;
  std::string frame;                    ///< Frame in the first header.
  double stamp_minus_received_s = 0.0;  ///< Median over messages with a stamp.
  std::uint64_t without_stamp = 0;      ///< Messages without a stamp; packets may have none.
  std::string cloud;                    ///< For clouds: CloudDecoder::description().
  /// Mean of an IMU's first 100 messages, in its own unit.
  Eigen::Vector3d force_mps2 = Eigen::Vector3d::Zero();
  std::string fault;  ///< Fault of the first unreadable message; empty = none.

  /// Messages per second; 0 where there are fewer than two.
  double rate_hz() const;
};

/// Summary of all topics with a role.
struct Survey {
  std::vector<TopicSurvey> topics;  ///< In the order of Bag::topics().
  StaticTransforms transforms;      ///< From .../tf_static, and constant ones from /tf.
};

/// Reads the messages of all topics with a role: only their headers, and the first clouds.
/// `progress` gets the number of messages read so far. Throws io::DataError where the container is
/// damaged; unreadable messages are noted in `fault`.
Survey survey(Bag& bag, const CloudOptions& options,
              const std::function<void(std::uint64_t)>& progress = {});

/// A reader of the message, or io::DataError.
MessageReader reader_of(const Bag& bag, const Message& message);

}  // namespace understory::bag
