#include "deploy/cli/import_bag_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/packets/survey.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

/// Below it a steering angle is noise [m/s].
constexpr double kSlow_mps = 0.1;
/// A faster turn at such a speed is more than noise [rad/s].
constexpr double kTurning_rad_s = 0.02;
constexpr double kMoved_m = 1.0;

/// Hesai's drivers have x to the right and y ahead where the decoder has x ahead and y to the left.
void turn_to_driver(model::PointSweep& sweep) {
  for (model::SweepPoint& point : sweep.points) point.x_m = -std::exchange(point.y_m, point.x_m);
}

model::Utime utime_of_stamp(std::int64_t stamp_ns) {
  if (stamp_ns < 0) throw io::DataError("a stamp before 1970");
  return stamp_ns / 1000;
}

double yaw_of(const Eigen::Isometry3d& pose) {
  return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0));
}

}  // namespace

BagMessages::BagMessages(const bag::Bag& bag, const bag::Survey& survey, const BagChoice& choice,
                         const BagMounts& mounts, BagConversion conversion, BagLog& log)
    : bag_(bag),
      survey_(survey),
      choice_(choice),
      mounts_(mounts),
      conversion_(std::move(conversion)),
      log_(log),
      numbers_(bag.topics().size(), 0),
      decoder_(conversion_.cloud) {}

void BagMessages::take(const bag::Message& message) {
  const std::uint64_t number = ++numbers_[message.topic];
  try {
    convert(message);
  } catch (const io::DataError& error) {
    throw io::DataError(
        fmt::format("{}, message {}: {}", bag_.topics()[message.topic].name, number, error.what()));
  }
}

void BagMessages::convert(const bag::Message& message) {
  const auto is = [&](const std::optional<std::size_t>& topic) { return topic == message.topic; };
  if (is(choice_.cloud)) take_cloud(message);
  if (is(choice_.scan)) take_scan(message);
  if (is(choice_.imu)) take_imu(message);
  if (is(choice_.odometry)) take_odometry(message);
  if (is(choice_.gnss)) take_fix(message);
  if (is(choice_.truth)) take_truth(message);
}

/// To be added to the topic's stamps.
std::int64_t BagMessages::shift_ns(std::size_t topic) const {
  if (!conversion_.by_reception.contains(topic)) return 0;
  constexpr double kMost_ns = 4e18;
  const double shift = -1e9 * survey_.topics[topic].stamp_minus_received_s;
  return std::llround(std::clamp(shift, -kMost_ns, kMost_ns));
}

/// On the clock of the log.
std::int64_t BagMessages::stamp_ns(const bag::Header& header, const bag::Message& message) const {
  if (has_stamp(header, message.received_ns)) return header.stamp_ns + shift_ns(message.topic);
  if (!conversion_.by_reception.contains(message.topic))
    throw io::DataError(fmt::format("its stamp is 0: --receive-time {} takes the time of reception",
                                    bag_.topics()[message.topic].name));
  return message.received_ns;
}

model::Utime BagMessages::utime_of(const bag::Header& header, const bag::Message& message) const {
  return utime_of_stamp(stamp_ns(header, message));
}

void BagMessages::add_sweep(const model::PointSweep& sweep) {
  if (sweep.points.empty()) {
    ++empty_clouds_;
    return;
  }
  if (sweep.utime < 0) throw io::DataError("a stamp before 1970");
  has_times_ = sweep.has_times;
  has_rings_ = sweep.rings > 0;
  log_.add_sweep(sweep);
}

void BagMessages::take_cloud(const bag::Message& message) {
  const std::string& type = bag_.topics()[message.topic].type;
  if (bag::is_packet_type(type)) return take_packets(message);
  bag::MessageReader reader = reader_of(bag_, message);
  const auto decoded = [&](auto cloud) {
    const std::int64_t on_log_ns = stamp_ns(cloud.header, message);
    if (!has_stamp(cloud.header, message.received_ns)) cloud.header.stamp_ns = on_log_ns;
    // The decoder compares times of points with the stamp as it is.
    model::PointSweep sweep = decoder_.decode(cloud);
    sweep.utime += (on_log_ns - cloud.header.stamp_ns) / 1000;
    return sweep;
  };
  add_sweep(type == "sensor_msgs/PointCloud2" ? decoded(read_point_cloud(reader))
                                              : decoded(read_livox_cloud(reader)));
}

void BagMessages::make_laser(const bag::PacketScan::Packet& packet, const std::string& type) {
  packets::SensorDescription laser = conversion_.laser;
  if (laser.model.empty() && bag::is_ouster_packet_type(type)) laser.model = "ouster";
  if (laser.model.empty()) {
    const packets::Recognised found =
        packets::recognise({0, 0, 0, 0, {packet.bytes.begin(), packet.bytes.end()}});
    if (found.model.empty())
      throw io::DataError(fmt::format("packets of {} bytes ({}): --model is one of {}",
                                      packet.bytes.size(), found.text, packets::known_models()));
    laser.model = found.model;
  }
  laser_ = packets::make_decoder(laser);
  laser_model_ = laser.model;
}

void BagMessages::take_packets(const bag::Message& message) {
  const std::string& type = bag_.topics()[message.topic].type;
  const bag::MessageReader reader = reader_of(bag_, message);
  for (const bag::PacketScan::Packet& packet : read_packets(reader, type).packets) {
    const std::int64_t stamp_ns =
        packet.stamp_ns != 0 ? packet.stamp_ns + shift_ns(message.topic) : message.received_ns;
    if (!laser_) make_laser(packet, type);
    take_readings(add(*laser_, {packet.bytes, stamp_ns / 1000}));
  }
}

void BagMessages::take_readings(const packets::Readings& readings) {
  if (choice_.imu && bag::is_packet_type(bag_.topics()[*choice_.imu].type)) {
    for (const model::ImuSample& sample : readings.imu) log_.add("RAW_IMU", sample, sample.utime);
  }
  if (!choice_.cloud) return;
  for (model::PointSweep sweep : readings.sweeps) {
    if (std::holds_alternative<packets::HesaiStream>(*laser_)) turn_to_driver(sweep);
    add_sweep(sweep);
  }
}

void BagMessages::take_scan(const bag::Message& message) {
  bag::MessageReader reader = reader_of(bag_, message);
  bag::LaserScan scan = read_laser_scan(reader);
  scan.scan.utime = utime_of(scan.header, message);
  const model::Utime end = scan.scan.end();
  log_.add("RAW_SCAN", std::move(scan.scan), end);
}

void BagMessages::take_imu(const bag::Message& message) {
  if (bag::is_packet_type(bag_.topics()[message.topic].type)) return take_packets(message);
  bag::MessageReader reader = reader_of(bag_, message);
  const bag::Imu imu = read_imu(reader);
  model::ImuSample sample;
  sample.utime = utime_of(imu.header, message);
  sample.angular_rate_rad_s = imu.angular_rate_rad_s;
  sample.specific_force_mps2 = imu.specific_force_mps2;
  log_.add("RAW_IMU", sample, sample.utime);
}

/// Velocity of the vehicle's origin and angular rate, frame `vehicle`, from those of a frame on it.
std::pair<Eigen::Vector3d, Eigen::Vector3d> BagMessages::on_vehicle(const bag::Odometry& odometry,
                                                                    const std::string& frame) {
  const auto mount =
      frame.empty() ? std::make_optional(Eigen::Isometry3d::Identity()) : mounts_.find(frame);
  if (!mount) {
    twist_frame_ = frame;
    return {odometry.velocity_mps, odometry.angular_rate_rad_s};
  }
  const Eigen::Vector3d rate_rad_s = mount->linear() * odometry.angular_rate_rad_s;
  const Eigen::Vector3d lever_m = mount->translation();
  return {mount->linear() * odometry.velocity_mps - rate_rad_s.cross(lever_m), rate_rad_s};
}

void BagMessages::take_odometry(const bag::Message& message) {
  bag::MessageReader reader = reader_of(bag_, message);
  const std::string& type = bag_.topics()[message.topic].type;
  if (conversion_.has_speed_from_pose && bag::is_twist_type(type))
    throw io::DataError("--speed-from-pose: " + type + " has no pose");
  bag::Odometry odometry = read_odometry(reader, type);
  bag::Pose& pose = odometry.pose;
  pose.header.stamp_ns = stamp_ns(pose.header, message);
  if (!odometry.velocity_mps.allFinite() || !odometry.angular_rate_rad_s.allFinite())
    throw io::DataError("a velocity that is no number");
  const auto [velocity_mps, vehicle_rate_rad_s] =
      on_vehicle(odometry, bag::is_twist_type(type) ? pose.header.frame : pose.child_frame);
  PlanarMotion motion{velocity_mps.x(), velocity_mps.y(), vehicle_rate_rad_s.z()};
  fastest_mps_ = std::max(fastest_mps_, odometry.velocity_mps.norm());
  if (!first_position_m_) first_position_m_ = pose.pose.translation();
  farthest_m_ = std::max(farthest_m_, (pose.pose.translation() - *first_position_m_).norm());

  const auto last = std::exchange(last_pose_, pose);
  if (conversion_.has_speed_from_pose) {
    const double seconds =
        last ? 1e-9 * static_cast<double>(pose.header.stamp_ns - last->header.stamp_ns) : 0.0;
    if (seconds <= 0.0) return;
    const Eigen::Isometry3d moved = last->pose.inverse() * pose.pose;
    motion = {moved.translation().x() / seconds, moved.translation().y() / seconds,
              yaw_of(moved) / seconds};
  }
  add_wheels(motion, utime_of_stamp(pose.header.stamp_ns));
}

/// Speed and steering of a car: what no car can do is counted.
void BagMessages::add_wheels(const PlanarMotion& motion, model::Utime utime) {
  model::WheelSample wheels;
  wheels.utime = utime;
  wheels.speed_mps = motion.forward_mps;
  const bool is_slow = std::abs(motion.forward_mps) <= kSlow_mps;
  if (!is_slow)
    wheels.steering_rad =
        std::atan(conversion_.wheelbase_m * motion.rate_rad_s / motion.forward_mps);
  if (is_slow && std::abs(motion.rate_rad_s) > kTurning_rad_s) ++turns_on_the_spot_;
  if (std::abs(motion.left_mps) > kSlow_mps) ++sideways_;
  log_.add("RAW_WHEELS", wheels, wheels.utime);
}

void BagMessages::take_fix(const bag::Message& message) {
  bag::MessageReader reader = reader_of(bag_, message);
  const bag::NavSatFix fix = read_nav_sat_fix(reader);
  if (!fix.has_fix) {
    ++without_fix_;
    return;
  }
  if (!plane_) plane_.emplace(fix.latitude_deg, fix.longitude_deg);
  model::GnssFix out;
  out.utime = utime_of(fix.header, message);
  out.east_north_m = plane_->east_north_m(fix.latitude_deg, fix.longitude_deg);
  out.sigma_m = fix.sigma_m;
  gnss_t message_out = wire::to_wire(out);
  message_out.has_geodetic = 1;
  message_out.latitude_deg = fix.latitude_deg;
  message_out.longitude_deg = fix.longitude_deg;
  message_out.altitude_m = fix.altitude_m;
  log_.add("RAW_GNSS", message_out, out.utime);
}

void BagMessages::take_truth(const bag::Message& message) {
  bag::MessageReader reader = reader_of(bag_, message);
  const bag::Pose pose = read_pose(reader, bag_.topics()[message.topic].type);
  const std::string& frame =
      conversion_.truth_frame.empty() ? pose.child_frame : conversion_.truth_frame;
  Eigen::Isometry3d world_T_vehicle = pose.pose;
  if (!frame.empty() && frame != mounts_.base()) {
    const auto vehicle_T_frame = mounts_.find(frame);
    if (!vehicle_T_frame)
      throw io::DataError("the pose is that of " + frame + ": " + mounts_.missing(frame));
    world_T_vehicle = pose.pose * vehicle_T_frame->inverse();
  }

  ground_truth_t truth{};
  truth.utime = utime_of(pose.header, message);
  truth.world_T_vehicle = wire::to_wire(
      geometry::SE2(world_T_vehicle.translation().head<2>(), yaw_of(world_T_vehicle)));
  log_.add("GROUND_TRUTH", truth, truth.utime);
}

void BagMessages::finish() {
  if (laser_) {
    packets::Readings last;
    if (auto sweep = packets::finish(*laser_)) last.sweeps.push_back(*std::move(sweep));
    take_readings(last);
  }
  if (choice_.odometry && !conversion_.has_speed_from_pose && fastest_mps_ == 0.0 &&
      farthest_m_ > kMoved_m)
    throw io::DataError(
        fmt::format("{}: its poses move by {:.1f} m and its twist is always zero: "
                    "--speed-from-pose takes the speed from the poses",
                    bag_.topics()[*choice_.odometry].name, farthest_m_));
}

std::string BagMessages::cloud_text() const {
  if (!choice_.cloud) return {};
  if (!laser_) return decoder_.description();
  const packets::StreamCounts& counts = packets::counts(*laser_);
  return fmt::format("{} packets of {}, {} refused, {} gaps", counts.packets, laser_model_,
                     counts.refused, counts.gaps);
}

std::vector<std::string> BagMessages::remarks() const {
  std::vector<std::string> lines;
  if (empty_clouds_ > 0)
    lines.push_back(fmt::format("{} clouds without a point are left out", empty_clouds_));
  if (without_fix_ > 0)
    lines.push_back(fmt::format("{} messages of GNSS without a fix are left out", without_fix_));
  if (!twist_frame_.empty())
    lines.push_back(
        fmt::format("the velocity is taken as the vehicle's, though it is that of {}: {}",
                    twist_frame_, mounts_.missing(twist_frame_)));
  const auto left_out = [&](std::uint64_t count, const std::string& what) {
    if (count > 0)
      lines.push_back(fmt::format("{}: {} of {} messages {}", bag_.topics()[*choice_.odometry].name,
                                  count, numbers_[*choice_.odometry], what));
  };
  left_out(turns_on_the_spot_,
           fmt::format("turn by more than {} rad/s at {} m/s or less: RAW_WHEELS has speed and "
                       "steering, so this yaw rate is left out (an IMU measures it)",
                       kTurning_rad_s, kSlow_mps));
  left_out(sideways_, fmt::format("move sideways by more than {} m/s: RAW_WHEELS has the forward "
                                  "speed alone",
                                  kSlow_mps));
  if (log_.late() > 0)
    lines.push_back(
        fmt::format("{} messages have stamps more than 1 s behind others: do the clocks "
                    "agree? (--list; --receive-time TOPIC)",
                    log_.late()));
  return lines;
}

}  // namespace understory::cli
