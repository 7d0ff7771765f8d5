// ROS messages as bytes, written by the definitions alone: the other side of common/bag.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/bag/bag.hpp"
#include "common/bag/messages.hpp"

namespace understory::test {

using MessageBytes = std::vector<std::uint8_t>;

/// How a message is serialised.
struct Serialisation {
  bag::Encoding encoding = bag::Encoding::kCdr;
  bool is_big_endian = false;  ///< CDR alone.
};

class MessageWriter {
 public:
  explicit MessageWriter(const Serialisation& how) : how_(how) {
    if (how.encoding == bag::Encoding::kCdr)
      bytes_ = {0, static_cast<std::uint8_t>(how.is_big_endian ? 0 : 1), 0, 0};
    begin_ = bytes_.size();
  }

  template <class T>
  MessageWriter& number(T value) {
    if (how_.encoding == bag::Encoding::kCdr) {
      while ((bytes_.size() - begin_) % sizeof(T) != 0) bytes_.push_back(0);
    }
    std::array<std::uint8_t, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    if (how_.is_big_endian) std::reverse(raw.begin(), raw.end());
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  MessageWriter& text(std::string_view value) {
    const bool is_cdr = how_.encoding == bag::Encoding::kCdr;
    number(static_cast<std::uint32_t>(value.size() + (is_cdr ? 1 : 0)));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    if (is_cdr) bytes_.push_back(0);
    return *this;
  }
  MessageWriter& raw(std::span<const std::uint8_t> value) {
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  MessageWriter& sequence(std::span<const std::uint8_t> value) {
    return number(static_cast<std::uint32_t>(value.size())).raw(value);
  }
  MessageWriter& numbers(std::span<const double> values) {
    for (const double value : values) number(value);
    return *this;
  }
  MessageWriter& zeros(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) number(0.0);
    return *this;
  }
  MessageWriter& stamp(std::int64_t stamp_ns) {
    number(static_cast<std::uint32_t>(stamp_ns / 1'000'000'000));
    return number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
  }
  MessageWriter& header(const bag::Header& header) {
    if (how_.encoding == bag::Encoding::kRos1) number(std::uint32_t{7});
    return stamp(header.stamp_ns).text(header.frame);
  }
  MessageWriter& pose(const Eigen::Isometry3d& pose) {
    const Eigen::Vector3d p = pose.translation();
    const Eigen::Quaterniond q(pose.linear());
    return numbers(std::array{p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()});
  }

  const MessageBytes& bytes() const { return bytes_; }

 private:
  Serialisation how_;
  MessageBytes bytes_;
  std::size_t begin_ = 0;
};

inline MessageBytes imu_message(const Serialisation& how, const bag::Imu& imu) {
  MessageWriter writer(how);
  writer.header(imu.header).zeros(4 + 9);
  writer.numbers(std::span(imu.angular_rate_rad_s.data(), 3)).zeros(9);
  writer.numbers(std::span(imu.specific_force_mps2.data(), 3)).zeros(9);
  return writer.bytes();
}

inline MessageBytes odometry_message(const Serialisation& how, const bag::Odometry& odometry) {
  MessageWriter writer(how);
  writer.header(odometry.pose.header).text(odometry.pose.child_frame).pose(odometry.pose.pose);
  writer.zeros(36).numbers(std::span(odometry.velocity_mps.data(), 3));
  writer.numbers(std::span(odometry.angular_rate_rad_s.data(), 3)).zeros(36);
  return writer.bytes();
}

/// TwistStamped; with the covariance TwistWithCovarianceStamped.
inline MessageBytes twist_message(const Serialisation& how, const bag::Odometry& odometry,
                                  bool has_covariance) {
  MessageWriter writer(how);
  writer.header(odometry.pose.header).numbers(std::span(odometry.velocity_mps.data(), 3));
  writer.numbers(std::span(odometry.angular_rate_rad_s.data(), 3));
  return writer.zeros(has_covariance ? 36 : 0).bytes();
}

inline MessageBytes pose_message(const Serialisation& how, const bag::Pose& pose) {
  return MessageWriter(how).header(pose.header).pose(pose.pose).bytes();
}

/// Packets as Hesai's drivers put them into a scan: an array of `fixed_bytes` (0 = a sequence).
inline MessageBytes scan_message(const Serialisation& how, const bag::PacketScan& scan,
                                 bool has_header, std::size_t fixed_bytes) {
  MessageWriter writer(how);
  if (has_header) writer.header(scan.header);
  writer.number(static_cast<std::uint32_t>(scan.packets.size()));
  for (const bag::PacketScan::Packet& packet : scan.packets) {
    writer.stamp(packet.stamp_ns);
    if (fixed_bytes == 0) {
      writer.sequence(packet.bytes);
    } else {
      const std::vector<std::uint8_t> rest(fixed_bytes - packet.bytes.size());
      writer.raw(packet.bytes).raw(rest);
    }
    writer.number(static_cast<std::uint32_t>(packet.bytes.size()));
  }
  return writer.bytes();
}

/// A frame in another one, as static transforms have it.
inline bag::Pose frame_in(const std::string& parent, const std::string& child,
                          const Eigen::Isometry3d& parent_T_child) {
  bag::Pose pose;
  pose.header.frame = parent;
  pose.child_frame = child;
  pose.pose = parent_T_child;
  return pose;
}

inline MessageBytes transforms_message(const Serialisation& how,
                                       const std::vector<bag::Pose>& transforms) {
  MessageWriter writer(how);
  writer.number(static_cast<std::uint32_t>(transforms.size()));
  for (const bag::Pose& transform : transforms)
    writer.header(transform.header).text(transform.child_frame).pose(transform.pose);
  return writer.bytes();
}

inline MessageBytes fix_message(const Serialisation& how, const bag::NavSatFix& fix) {
  MessageWriter writer(how);
  writer.header(fix.header).number(static_cast<std::int8_t>(fix.has_fix ? 0 : -1));
  writer.number(std::uint16_t{1}).number(fix.latitude_deg).number(fix.longitude_deg);
  writer.number(fix.altitude_m);
  const double variance = fix.sigma_m * fix.sigma_m;
  writer.numbers(std::array{variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, 1.0});
  writer.number(std::uint8_t{2});
  return writer.bytes();
}

inline MessageBytes scan_message(const Serialisation& how, const bag::Header& header,
                                 const model::PlanarScan& scan) {
  MessageWriter writer(how);
  writer.header(header).number(static_cast<float>(scan.first_bearing_rad)).number(1.0F);
  writer.number(static_cast<float>(scan.bearing_step_rad));
  writer.number(static_cast<float>(scan.beam_interval_s)).number(0.1F).number(0.05F);
  writer.number(static_cast<float>(scan.max_range_m));
  writer.number(static_cast<std::uint32_t>(scan.ranges_m.size()));
  for (const float range_m : scan.ranges_m) writer.number(range_m);
  writer.number(std::uint32_t{0});
  return writer.bytes();
}

inline MessageBytes cloud_message(const Serialisation& how, const bag::PointCloud& cloud) {
  MessageWriter writer(how);
  writer.header(cloud.header).number(cloud.height).number(cloud.width);
  writer.number(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const bag::PointField& field : cloud.fields)
    writer.text(field.name).number(field.offset).number(field.type).number(field.count);
  writer.number(static_cast<std::uint8_t>(cloud.is_big_endian ? 1 : 0));
  writer.number(cloud.point_step).number(cloud.row_step).sequence(cloud.data);
  writer.number(std::uint8_t{1});
  return writer.bytes();
}

inline MessageBytes livox_message(const Serialisation& how, const bag::LivoxCloud& cloud) {
  MessageWriter writer(how);
  writer.header(cloud.header).number(cloud.base_ns);
  writer.number(static_cast<std::uint32_t>(cloud.points.size())).raw(std::array<std::uint8_t, 4>{});
  writer.number(static_cast<std::uint32_t>(cloud.points.size()));
  for (const bag::LivoxCloud::Point& point : cloud.points) {
    writer.number(point.offset_ns);
    for (int axis = 0; axis < 3; ++axis) writer.number(point.position_m[axis]);
    writer.number(point.reflectivity).number(std::uint8_t{0}).number(point.line);
  }
  return writer.bytes();
}

}  // namespace understory::test
