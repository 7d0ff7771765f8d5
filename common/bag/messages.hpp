// ROS messages as values.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/bag/message_reader.hpp"
#include "common/model/planar_scan.hpp"

namespace understory::bag {

/// std_msgs/Header.
struct Header {
  std::int64_t stamp_ns = 0;  ///< Since the epoch of the sender's clock.
  std::string frame;          ///< Without a leading '/'.
};

/// sensor_msgs/PointField.
struct PointField {
  std::string name;
  std::uint32_t offset = 0;  ///< Offset in a point [bytes].
  std::uint8_t type = 0;     ///< INT8 = 1, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64.
  std::uint32_t count = 1;
};

/// sensor_msgs/PointCloud2; `data` refers to the message's bytes.
struct PointCloud {
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool is_big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::span<const std::uint8_t> data;
};

/// livox_ros_driver/CustomMsg, livox_ros_driver2/CustomMsg.
struct LivoxCloud {
  /// One point.
  struct Point {
    std::uint32_t offset_ns = 0;  ///< Time after `base_ns`.
    Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
    std::uint8_t reflectivity = 0;
    std::uint8_t line = 0;
  };
  Header header;
  std::uint64_t base_ns = 0;  ///< Time of the first point, sensor's clock.
  std::vector<Point> points;
};

/// sensor_msgs/LaserScan.
struct LaserScan {
  Header header;
  model::PlanarScan scan;  ///< Times relative to the stamp; only ranges with a return.
};

/// sensor_msgs/Imu.
struct Imu {
  Header header;
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
};

/// A pose from any message that has one: PoseStamped, PoseWithCovarianceStamped, TransformStamped,
/// Odometry.
struct Pose {
  Header header;
  std::string child_frame;  ///< Frame of the pose; empty = not in the message.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
};

/// nav_msgs/Odometry.
struct Odometry {
  Pose pose;
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();  ///< Frame `child_frame`.
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero();
};

/// sensor_msgs/NavSatFix.
struct NavSatFix {
  Header header;
  bool has_fix = false;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
  double sigma_m = 0.0;  ///< Horizontal standard deviation per axis; 0 = unknown.
};

/// Received UDP packets of a laser: velodyne_msgs/VelodyneScan, PandarScan of pandar_msgs and
/// hesai_lidar, hesai_ros_driver/UdpFrame, PacketMsg of Ouster's drivers (one packet, no header).
struct PacketScan {
  /// One packet; `bytes` refers to the message.
  struct Packet {
    std::int64_t stamp_ns = 0;  ///< 0 = the message has none.
    std::span<const std::uint8_t> bytes;
  };
  Header header;
  std::vector<Packet> packets;
};

// Each function throws io::DataError where the bytes are not such a message.

/// The header with which most messages begin.
Header read_header(MessageReader& reader);
/// False where the sender left the stamp at 0. A simulated clock may start at 0; then the
/// recorder's clock starts there too.
bool has_stamp(const Header& header, std::int64_t received_ns);
/// sensor_msgs/PointCloud2. Fields and data are compared later, in CloudDecoder.
PointCloud read_point_cloud(MessageReader& reader);
/// CustomMsg of both Livox drivers.
LivoxCloud read_livox_cloud(MessageReader& reader);
/// sensor_msgs/LaserScan.
LaserScan read_laser_scan(MessageReader& reader);
/// sensor_msgs/Imu.
Imu read_imu(MessageReader& reader);
/// nav_msgs/Odometry, or a message of a twist type: then only the header of the pose is set.
Odometry read_odometry(MessageReader& reader, const std::string& type);
/// Whether the type has only a velocity: TwistStamped, TwistWithCovarianceStamped.
bool is_twist_type(const std::string& type);
/// sensor_msgs/NavSatFix.
NavSatFix read_nav_sat_fix(MessageReader& reader);
/// Reads a message of a packet type from its begin.
PacketScan read_packets(const MessageReader& message, const std::string& type);
/// Whether read_packets() reads the type.
bool is_packet_type(const std::string& type);
/// Whether it is PacketMsg of one of Ouster's drivers.
bool is_ouster_packet_type(const std::string& type);
/// tf2_msgs/TFMessage. An invalid transform gets a NaN position; the others of the message are
/// kept.
std::vector<Pose> read_transforms(MessageReader& reader);
/// Reads a message of a pose type.
Pose read_pose(MessageReader& reader, const std::string& type);
/// Whether read_pose() reads the type.
bool is_pose_type(const std::string& type);

}  // namespace understory::bag
