#include "common/bag/messages.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include "common/io/data_error.hpp"
#include "common/io/velodyne.hpp"

namespace understory::bag {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::int64_t read_stamp(MessageReader& reader) {
  // Seconds are signed in ROS 2, unsigned in ROS 1: the same bits until 2038.
  const auto seconds = reader.encoding() == Encoding::kRos1
                           ? std::int64_t{reader.number<std::uint32_t>()}
                           : std::int64_t{reader.number<std::int32_t>()};
  return seconds * kSecond_ns + reader.number<std::uint32_t>();
}

std::string read_frame(MessageReader& reader) {
  std::string frame = reader.text();
  if (frame.starts_with('/')) frame.erase(0, 1);
  return frame;
}

Eigen::Vector3d read_vector(MessageReader& reader) {
  const auto x = reader.number<double>();
  const auto y = reader.number<double>();
  const auto z = reader.number<double>();
  return {x, y, z};
}

/// None where the numbers are not a valid pose.
std::optional<Eigen::Isometry3d> read_any_motion(MessageReader& reader) {
  const Eigen::Vector3d position = read_vector(reader);
  const Eigen::Vector3d axis = read_vector(reader);
  Eigen::Quaterniond rotation(reader.number<double>(), axis.x(), axis.y(), axis.z());
  const double norm = rotation.norm();
  // Drivers without a rotation send a quaternion of zeros.
  if (norm == 0.0) rotation = Eigen::Quaterniond::Identity();
  if (!position.allFinite() || !(norm == 0.0 || std::abs(norm - 1.0) < 0.1)) return std::nullopt;
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = rotation.normalized().toRotationMatrix();
  motion.translation() = position;
  return motion;
}

Eigen::Isometry3d read_motion(MessageReader& reader) {
  const auto motion = read_any_motion(reader);
  if (!motion) throw io::DataError("a pose whose numbers are no pose");
  return *motion;
}

constexpr std::size_t kCovariance3 = 9;
constexpr std::size_t kCovariance6 = 36;

}  // namespace

Header read_header(MessageReader& reader) {
  if (reader.encoding() == Encoding::kRos1) reader.number<std::uint32_t>();
  Header header;
  header.stamp_ns = read_stamp(reader);
  header.frame = read_frame(reader);
  return header;
}

bool has_stamp(const Header& header, std::int64_t received_ns) {
  return header.stamp_ns != 0 || std::abs(received_ns) < kSecond_ns;
}

PointCloud read_point_cloud(MessageReader& reader) {
  PointCloud cloud;
  cloud.header = read_header(reader);
  cloud.height = reader.number<std::uint32_t>();
  cloud.width = reader.number<std::uint32_t>();
  constexpr std::size_t kLeastField = 13;
  const std::size_t fields = reader.count(kLeastField);

  for (std::size_t i = 0; i < fields; ++i) {
    PointField field;
    field.name = reader.text();
    field.offset = reader.number<std::uint32_t>();
    field.type = reader.number<std::uint8_t>();
    field.count = reader.number<std::uint32_t>();
    cloud.fields.push_back(std::move(field));
  }

  cloud.is_big_endian = reader.number<std::uint8_t>() != 0;
  cloud.point_step = reader.number<std::uint32_t>();
  cloud.row_step = reader.number<std::uint32_t>();
  cloud.data = reader.bytes();
  return cloud;
}

LivoxCloud read_livox_cloud(MessageReader& reader) {
  LivoxCloud cloud;
  cloud.header = read_header(reader);
  cloud.base_ns = reader.number<std::uint64_t>();
  reader.number<std::uint32_t>();  // number of points; the length of the sequence is used instead
  reader.take(4);                  // number of the laser, reserved
  constexpr std::size_t kLeastPoint = 19;
  const std::size_t points = reader.count(kLeastPoint);
  cloud.points.reserve(points);

  for (std::size_t i = 0; i < points; ++i) {
    LivoxCloud::Point point;
    point.offset_ns = reader.number<std::uint32_t>();
    for (int axis = 0; axis < 3; ++axis) point.position_m[axis] = reader.number<float>();
    point.reflectivity = reader.number<std::uint8_t>();
    reader.number<std::uint8_t>();  // tag
    point.line = reader.number<std::uint8_t>();
    cloud.points.push_back(point);
  }
  return cloud;
}

LaserScan read_laser_scan(MessageReader& reader) {
  LaserScan result;
  result.header = read_header(reader);
  model::PlanarScan& scan = result.scan;
  scan.first_bearing_rad = reader.number<float>();
  reader.number<float>();  // last bearing
  scan.bearing_step_rad = reader.number<float>();
  scan.beam_interval_s = reader.number<float>();
  reader.number<float>();  // between scans
  const auto least_m = reader.number<float>();
  scan.max_range_m = reader.number<float>();
  const bool is_finite = std::isfinite(scan.first_bearing_rad) &&
                         std::isfinite(scan.bearing_step_rad) &&
                         std::isfinite(scan.beam_interval_s) && scan.max_range_m > 0.0;
  if (!is_finite || scan.beam_interval_s < 0.0) throw io::DataError("a scan without geometry");

  const std::size_t beams = reader.count(sizeof(float));
  scan.ranges_m.reserve(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    const auto range_m = reader.number<float>();
    const bool is_return = std::isfinite(range_m) && range_m >= least_m && range_m > 0.0F;
    scan.ranges_m.push_back(is_return ? range_m : 0.0F);
  }
  return result;
}

Imu read_imu(MessageReader& reader) {
  Imu imu;
  imu.header = read_header(reader);
  reader.skip<double>(4 + kCovariance3);
  imu.angular_rate_rad_s = read_vector(reader);
  reader.skip<double>(kCovariance3);
  imu.specific_force_mps2 = read_vector(reader);
  return imu;
}

bool is_twist_type(const std::string& type) {
  return type == "geometry_msgs/TwistStamped" || type == "geometry_msgs/TwistWithCovarianceStamped";
}

Odometry read_odometry(MessageReader& reader, const std::string& type) {
  Odometry odometry;
  odometry.pose.header = read_header(reader);
  if (!is_twist_type(type)) {
    odometry.pose.child_frame = read_frame(reader);
    odometry.pose.pose = read_motion(reader);
    reader.skip<double>(kCovariance6);
  }
  odometry.velocity_mps = read_vector(reader);
  odometry.angular_rate_rad_s = read_vector(reader);
  return odometry;
}

NavSatFix read_nav_sat_fix(MessageReader& reader) {
  NavSatFix fix;
  fix.header = read_header(reader);
  const auto status = reader.number<std::int8_t>();
  reader.number<std::uint16_t>();  // services
  fix.latitude_deg = reader.number<double>();
  fix.longitude_deg = reader.number<double>();
  fix.altitude_m = reader.number<double>();

  std::array<double, kCovariance3> covariance{};
  for (double& value : covariance) value = reader.number<double>();
  const auto covariance_kind = reader.number<std::uint8_t>();
  const double variance = 0.5 * (covariance[0] + covariance[4]);
  if (covariance_kind != 0 && std::isfinite(variance) && variance > 0.0)
    fix.sigma_m = std::sqrt(variance);
  // Receivers without a position send zeros, some with the status of a fix.
  const bool is_zero = fix.latitude_deg == 0.0 && fix.longitude_deg == 0.0;
  fix.has_fix = status >= 0 && !is_zero && std::abs(fix.latitude_deg) <= 90.0 &&
                std::abs(fix.longitude_deg) <= 360.0;
  return fix;
}

namespace {

/// Layout of a scan's packets; drivers changed it under the same type name.
struct ScanLayout {
  bool has_header = true;
  std::size_t fixed_bytes = 0;  ///< Length of a packet's array; 0 = a sequence.
  bool has_size = true;         ///< The number of used bytes follows the array.
};

std::optional<PacketScan> read_scan(MessageReader reader, const ScanLayout& layout) {
  constexpr std::size_t kStamp = 8;
  constexpr std::size_t kPadding = 4;
  PacketScan scan;
  try {
    if (layout.has_header) scan.header = read_header(reader);
    const std::size_t packets = reader.count(kStamp + std::max<std::size_t>(layout.fixed_bytes, 4));

    for (std::size_t i = 0; i < packets; ++i) {
      PacketScan::Packet packet{read_stamp(reader), {}};
      packet.bytes = layout.fixed_bytes > 0 ? reader.take(layout.fixed_bytes) : reader.bytes();
      const std::size_t size =
          layout.has_size ? reader.number<std::uint32_t>() : packet.bytes.size();
      if (size > packet.bytes.size()) return std::nullopt;
      packet.bytes = packet.bytes.first(size);
      scan.packets.push_back(packet);
    }
  } catch (const io::DataError&) {
    return std::nullopt;
  }

  if (reader.rest() >= kPadding) return std::nullopt;
  return scan;
}

/// Layouts of HesaiLidar_General_ROS and Autoware's pandar_msgs, and of HesaiLidar_ROS_2.0; older
/// versions for ROS 2 have no header.
std::span<const ScanLayout> layouts_of(const std::string& type) {
  static constexpr std::array kVelodyne{ScanLayout{true, io::kVelodyneDataBytes, false}};
  static constexpr std::array kPandar{ScanLayout{true, 0, true}, ScanLayout{true, 1500, true}};
  static constexpr std::array kHesai{ScanLayout{true, 0, true}, ScanLayout{false, 0, true}};
  if (type == "velodyne_msgs/VelodyneScan") return kVelodyne;
  if (type == "pandar_msgs/PandarScan" || type == "hesai_lidar/PandarScan") return kPandar;
  if (type == "hesai_ros_driver/UdpFrame") return kHesai;
  return {};
}

}  // namespace

bool is_ouster_packet_type(const std::string& type) {
  return type == "ouster_ros/PacketMsg" || type == "ouster_msgs/PacketMsg" ||
         type == "ouster_sensor_msgs/PacketMsg";
}

bool is_packet_type(const std::string& type) {
  return is_ouster_packet_type(type) || !layouts_of(type).empty();
}

PacketScan read_packets(const MessageReader& message, const std::string& type) {
  if (is_ouster_packet_type(type)) {
    MessageReader reader = message;
    return {{}, {{0, reader.bytes()}}};
  }
  for (const ScanLayout& layout : layouts_of(type)) {
    if (auto scan = read_scan(message, layout)) return *std::move(scan);
  }
  throw io::DataError("no packets as any version of " + type + " has them");
}

std::vector<Pose> read_transforms(MessageReader& reader) {
  constexpr std::size_t kLeastTransform = 8 + 2 * 4 + 7 * 8;
  std::vector<Pose> transforms(reader.count(kLeastTransform));
  for (Pose& transform : transforms) {
    transform.header = read_header(reader);
    transform.child_frame = read_frame(reader);
    const auto motion = read_any_motion(reader);
    if (motion) {
      transform.pose = *motion;
    } else {
      transform.pose.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return transforms;
}

bool is_pose_type(const std::string& type) {
  return type == "geometry_msgs/PoseStamped" || type == "geometry_msgs/PoseWithCovarianceStamped" ||
         type == "geometry_msgs/TransformStamped" || type == "nav_msgs/Odometry";
}

Pose read_pose(MessageReader& reader, const std::string& type) {
  Pose pose;
  pose.header = read_header(reader);
  const bool has_child = type == "geometry_msgs/TransformStamped" || type == "nav_msgs/Odometry";
  if (has_child) pose.child_frame = read_frame(reader);
  pose.pose = read_motion(reader);
  return pose;
}

}  // namespace understory::bag
