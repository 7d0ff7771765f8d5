// Messages of a bag as messages of a log.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/bag/survey.hpp"
#include "common/io/oxts.hpp"
#include "common/packets/decoder.hpp"
#include "deploy/cli/import_bag_choice.hpp"
#include "deploy/cli/import_bag_log.hpp"
#include "deploy/cli/import_bag_mounts.hpp"

namespace understory::cli {

/// How messages are taken.
struct BagConversion {
  bag::CloudOptions cloud;
  /// Of packets: model (empty = what they look like), the text that it needs, its source.
  packets::SensorDescription laser;
  double wheelbase_m = 2.7;            ///< For the steering of RAW_WHEELS.
  bool has_speed_from_pose = false;    ///< RAW_WHEELS from the poses of odometry, not its twist.
  std::string truth_frame;             ///< Whose pose the truth is; empty = as the message says.
  std::set<std::size_t> by_reception;  ///< Topics whose stamps are laid onto the recorder's clock;
                                       ///< a stamp of 0 is none.
};

/// Takes the messages of the chosen topics, one after another.
class BagMessages {
 public:
  /// What it refers to must outlive it.
  BagMessages(const bag::Bag& bag, const bag::Survey& survey, const BagChoice& choice,
              const BagMounts& mounts, BagConversion conversion, BagLog& log);

  /// Throws io::DataError naming topic and number of the message where it is damaged.
  void take(const bag::Message& message);
  /// What is under way (a revolution of packets) goes out. Throws io::DataError where odometry had
  /// no speeds.
  void finish();
  /// Whether the sweeps had times of points.
  bool has_times() const { return has_times_; }
  /// Whether they had rings.
  bool has_rings() const { return has_rings_; }
  /// How the cloud was read; empty without a cloud.
  std::string cloud_text() const;
  /// What could not be used: one line each.
  std::vector<std::string> remarks() const;

 private:
  /// Of the vehicle's origin, frame `vehicle`.
  struct PlanarMotion {
    double forward_mps = 0.0;
    double left_mps = 0.0;
    double rate_rad_s = 0.0;
  };
  void convert(const bag::Message& message);
  void take_cloud(const bag::Message& message);
  void take_packets(const bag::Message& message);
  void take_readings(const packets::Readings& readings);
  void make_laser(const bag::PacketScan::Packet& packet, const std::string& type);
  void add_sweep(const model::PointSweep& sweep);
  void take_scan(const bag::Message& message);
  void take_imu(const bag::Message& message);
  void take_odometry(const bag::Message& message);
  void add_wheels(const PlanarMotion& motion, model::Utime utime);
  std::pair<Eigen::Vector3d, Eigen::Vector3d> on_vehicle(const bag::Odometry& odometry,
                                                         const std::string& frame);
  void take_fix(const bag::Message& message);
  void take_truth(const bag::Message& message);
  std::int64_t shift_ns(std::size_t topic) const;
  std::int64_t stamp_ns(const bag::Header& header, const bag::Message& message) const;
  model::Utime utime_of(const bag::Header& header, const bag::Message& message) const;

  const bag::Bag& bag_;
  const bag::Survey& survey_;
  const BagChoice& choice_;
  const BagMounts& mounts_;
  BagConversion conversion_;
  BagLog& log_;
  std::vector<std::uint64_t> numbers_;  ///< Messages taken, by topic.
  bag::CloudDecoder decoder_;
  std::optional<packets::Decoder> laser_;  ///< Made when the first packet comes.
  std::string laser_model_;
  bool has_times_ = true;
  bool has_rings_ = true;
  std::uint64_t empty_clouds_ = 0;
  std::optional<io::LocalPlane> plane_;
  std::uint64_t without_fix_ = 0;
  std::optional<bag::Pose> last_pose_;  ///< Of odometry.
  std::string twist_frame_;             ///< Of a twist, where nothing joins it to the vehicle.
  double farthest_m_ = 0.0;             ///< From the first pose of odometry.
  double fastest_mps_ = 0.0;
  std::uint64_t turns_on_the_spot_ = 0;  ///< Messages of odometry.
  std::uint64_t sideways_ = 0;
  std::optional<Eigen::Vector3d> first_position_m_;
};

}  // namespace understory::cli
