// Random values of every kind that goes over the wire.
#pragma once

#include <numbers>
#include <random>

#include "tests/wire/all_types.hpp"

namespace understory::wire {

/// Values within what the wire allows; the same for the same seed.
class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed) {}
  double real(double scale) {
    return std::uniform_real_distribution<double>(-scale, scale)(random_);
  }
  std::size_t count() { return random_() % 6; }
  template <int N>
  Eigen::Matrix<double, N, N> covariance() {
    Eigen::Matrix<double, N, N> root;
    for (int i = 0; i < N * N; ++i) root(i) = real(0.3);
    const Eigen::Matrix<double, N, N> product = root * root.transpose();
    return 0.5 * (product + product.transpose());
  }
  geometry::SE2 pose() { return {real(100.0), real(100.0), real(3.0)}; }
  model::LandmarkKind kind() { return static_cast<model::LandmarkKind>(random_() % 2); }

  model::LandmarkScan scan() {
    model::LandmarkScan scan{1000, 7, {40.0, real(1.0), 3.0}, {}};
    for (std::size_t i = count(); i > 0; --i) {
      scan.detections.push_back({{real(40.0), real(40.0), real(2.0)},
                                 covariance<3>(),
                                 real(0.1) + 0.2,
                                 kind(),
                                 real(3.0),
                                 0.02});
    }
    return scan;
  }
  model::PlaceScan place_scan() {
    model::PlaceScan scan{10, 2, {}};
    const auto centimetres = [&] { return static_cast<std::int16_t>(random_() % 65536); };
    for (std::size_t i = 100 * count(); i > 0; --i) {
      const std::int16_t x = centimetres(), y = centimetres();
      scan.points.push_back({x, y, centimetres()});
    }
    return scan;
  }
  model::ViewRanges view_ranges() {
    model::ViewRanges ranges{10, 2, vector<2>(2.0), vector<2>(1.0), real(3.0), 0.01, 0.005, 0.25,
                             {}, {}};
    if (count() > 2) ranges.step_rad = -0.01;
    for (std::size_t i = 100 * count(); i > 0; --i) {
      ranges.free.push_back(static_cast<std::uint8_t>(random_() % 256));
      ranges.hidden.push_back(static_cast<std::uint8_t>(random_() % 256));
    }
    return ranges;
  }
  template <int N>
  Eigen::Matrix<double, N, 1> vector(double scale) {
    Eigen::Matrix<double, N, 1> result;
    for (int i = 0; i < N; ++i) result[i] = real(scale);
    return result;
  }
  model::Odometry odometry() {
    model::Odometry odometry{5,           10,         2, pose(), covariance<3>(), std::nullopt,
                             count() > 2, count() > 2};
    if (count() < 3) return odometry;

    model::Preintegration inertial;
    inertial.seconds = 0.1;
    inertial.yaw_rad = real(1.0);
    inertial.velocity_mps = vector<2>(3.0);
    inertial.position_m = vector<2>(1.0);
    inertial.covariance = covariance<5>();
    inertial.level = {covariance<2>(), Eigen::Matrix2d::Identity(), covariance<2>(), real(0.1)};
    inertial.level.memory(0, 1) = real(1.0);
    for (int i = 0; i < 15; ++i) inertial.bias_jacobian(i) = real(1.0);
    inertial.bias = vector<3>(0.1);
    odometry.inertial = inertial;

    return odometry;
  }
  model::PointSweep sweep(double farthest_m) {
    model::PointSweep sweep;
    sweep.utime = 1000;
    sweep.revolution = 7;
    sweep.part = static_cast<std::uint16_t>(count());
    sweep.parts = 8;
    sweep.is_deskewed = count() > 2;
    sweep.rings = 32;
    sweep.max_range_m = 100.0;
    sweep.sensor_position_m = vector<3>(2.0);
    if (count() > 2) {
      model::Attitude attitude;
      attitude.level_Q_vehicle = Eigen::AngleAxisd(0.1, vector<3>(1.0).normalized());
      attitude.covariance_rad2 = covariance<2>();
      sweep.attitude = attitude;
    }

    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector3f p = vector<3>(farthest_m).cast<float>();
      sweep.points.push_back({p.x(), p.y(), p.z(), static_cast<float>(real(0.1)),
                              static_cast<std::uint16_t>(random_() % 32),
                              static_cast<std::uint8_t>(random_() % 256)});
    }

    return sweep;
  }
  model::Keyframe keyframe() {
    model::Keyframe keyframe{1000,         3, {40.0, 0.0, 2.0 * std::numbers::pi}, {}, {},
                             std::nullopt, {}};
    if (count() > 2) keyframe.previous_T_base = pose();
    for (std::size_t i = 0; i <= count(); ++i) {
      keyframe.members.push_back(
          {static_cast<model::Utime>(1000 + 100 * i), 50 + i, pose(), covariance<3>()});
    }
    for (std::size_t i = count(); i > 0; --i) {
      keyframe.landmarks.push_back(
          {{real(40.0), real(40.0)}, covariance<2>(), 0.2, static_cast<std::uint16_t>(i), kind()});
    }
    for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i)
      keyframe.detections.push_back({0, 3 * i, i});
    return keyframe;
  }
  /// Of a keyframe or between them, in any map.
  model::SlamPose slam_pose() {
    model::SlamPose result;
    result.utime = 10;
    result.sequence = 2;
    switch (random_() % 6) {
      case 0:
        result.status = model::MapUpdateStatus::kUpdated;
        break;
      case 1:
        result.status = model::MapUpdateStatus::kFirstMap;
        result.is_new_map = random_() % 2 == 0;
        break;
      case 2:
        result.status = model::MapUpdateStatus::kNotSure;
        result.is_lost = random_() % 2 == 0;
        break;
      case 3:
        result.is_coasting = true;
        break;
      default:
        break;
    }
    if (result.status) result.keyframe_sequence = 4;
    result.submap_T_vehicle = pose();
    result.covariance = covariance<3>();
    result.correction_version = 3;
    result.map_T_submap = pose();
    result.map_T_odom = pose();
    result.reset_counter = 1;
    result.reset_delta = pose();
    result.map_id = 1 + static_cast<std::uint32_t>(random_() % 0x7fff);
    result.is_provisional = random_() % 2 == 0;
    return result;
  }
  model::MapLandmark landmark() {
    return {random_() | 1U, {real(400.0), real(400.0)}, covariance<2>(), 0.2, 9, kind()};
  }
  std::vector<model::MapLandmark> landmarks() {
    std::vector<model::MapLandmark> result(count());
    for (model::MapLandmark& one : result) one = landmark();
    return result;
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace understory::wire
