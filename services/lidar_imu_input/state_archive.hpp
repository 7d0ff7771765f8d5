// The stage's state as bytes: written and read by the same list of members.
//
// A class lists its members once:
//   template <class Archive, class Self> static void archive(Archive& a, Self& self) {
//     a(self.first_, self.second_);
//   }
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/wheels.hpp"

namespace understory::lidar_imu_input {

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
concept Matrix = std::derived_from<T, Eigen::PlainObjectBase<T>> && T::SizeAtCompileTime >
0;

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;
template <class T>
constexpr bool kIsList<std::deque<T>> = true;
template <class T>
constexpr bool kIsOptional = false;
template <class T>
constexpr bool kIsOptional<std::optional<T>> = true;

template <class Self, class T>
concept Is = std::same_as<std::remove_const_t<Self>, T>;

template <class Archive, class Self>
requires Is<Self, model::ImuSample>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.angular_rate_rad_s, s.specific_force_mps2);
}
template <class Archive, class Self>
requires Is<Self, model::WheelSample>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.speed_mps, s.steering_rad); }
template <class Archive, class Self>
requires Is<Self, model::GnssFix>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.east_north_m, s.sigma_m, s.velocity_mps, s.velocity_sigma_mps);
}
template <class Archive, class Self>
requires Is<Self, model::VelocityCorrection>
void archive(Archive& a, Self& s) { a(s.utime, s.sequence, s.velocity_mps, s.bias, s.covariance); }
template <class Archive, class Self>
requires Is<Self, model::PlanarScan>
void archive(Archive& a, Self& s) {
  a(s.utime, s.sequence, s.first_bearing_rad, s.bearing_step_rad, s.max_range_m, s.ranges_m);
}
template <class Archive, class Self>
requires Is<Self, model::SweepPoint>
void archive(Archive& a, Self& s) { a(s.x_m, s.y_m, s.z_m, s.time_s, s.ring, s.intensity); }

/// Appends values to bytes.
class Writer {
 public:
  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (Number<T>) {
      put_bytes(&value, sizeof(T));
    } else if constexpr (Matrix<T>) {
      put_bytes(value.data(), sizeof(typename T::Scalar) * T::SizeAtCompileTime);
    } else if constexpr (std::same_as<T, Eigen::Quaterniond>) {
      put(value.coeffs());
    } else if constexpr (std::same_as<T, geometry::SE2>) {
      put(value.coordinates());
    } else if constexpr (kIsOptional<T>) {
      put(value.has_value());
      if (value) put(*value);
    } else if constexpr (kIsList<T>) {
      put(static_cast<std::uint64_t>(value.size()));
      for (const auto& element : value) put(element);
    } else if constexpr (requires { T::archive(*this, value); }) {
      T::archive(*this, value);
    } else {
      archive(*this, value);
    }
  }
  void put_bytes(const void* from, std::size_t size) {
    bytes_.append(static_cast<const char*>(from), size);
  }

  std::string bytes_;
};

/// Takes values from what a Writer gave. Throws std::invalid_argument where bytes are missing.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  template <class... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  bool is_at_end() const { return bytes_.empty(); }

 private:
  template <class T>
  void get(T& value) {
    if constexpr (std::same_as<T, bool>) {
      std::uint8_t byte = 0;
      get_bytes(&byte, sizeof(byte));
      value = byte != 0;
    } else if constexpr (Number<T>) {
      get_bytes(&value, sizeof(T));
    } else if constexpr (Matrix<T>) {
      get_bytes(value.data(), sizeof(typename T::Scalar) * T::SizeAtCompileTime);
    } else if constexpr (std::same_as<T, Eigen::Quaterniond>) {
      get(value.coeffs());
    } else if constexpr (std::same_as<T, geometry::SE2>) {
      Eigen::Vector3d coordinates;
      get(coordinates);
      value = geometry::SE2(coordinates.head<2>(), coordinates.z());
    } else if constexpr (kIsOptional<T>) {
      bool is_there = false;
      get(is_there);
      value.reset();
      if (is_there) get(value.emplace());
    } else if constexpr (kIsList<T>) {
      std::uint64_t size = 0;
      get(size);
      // Every element has a byte at least: a damaged number asks for no memory.
      if (size > bytes_.size()) throw std::invalid_argument("state: a list is cut off");
      value.clear();
      for (std::uint64_t i = 0; i < size; ++i) get(value.emplace_back());
    } else if constexpr (requires { T::archive(*this, value); }) {
      T::archive(*this, value);
    } else {
      archive(*this, value);
    }
  }
  void get_bytes(void* to, std::size_t size) {
    if (size > bytes_.size()) throw std::invalid_argument("state: it is cut off");
    std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }

  std::string_view bytes_;
};

}  // namespace understory::lidar_imu_input
