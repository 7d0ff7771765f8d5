#include "common/place_recognition/stem_likelihood.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/geometry/alignment.hpp"

namespace understory::place_recognition {
namespace {

/// Radius in which the density around a stem is counted [m].
constexpr double kCrowdRadiusM = 4.0;
/// Uncertainty of the pose in each round of the refinement: at the origin [m], and per metre of
/// distance.
struct RefineSpread {
  double on_the_spot_m;
  double per_metre;
};
constexpr std::array kSpreads{RefineSpread{0.20, 0.015}, RefineSpread{0.10, 0.006},
                              RefineSpread{0.03, 0.002}, RefineSpread{0.0, 0.0},
                              RefineSpread{0.0, 0.0},    RefineSpread{0.0, 0.0}};
/// Stems farther than this many wide sigmas are ignored.
constexpr double kFarSigmas = 4.0;
constexpr double kUnknownVariance = 1e4;
/// Fewer diameters do not determine a spread; too narrow a spread would give every diameter too
/// much weight.
constexpr double kLeastDiameters = 20.0;
constexpr double kLeastSpread = 0.1;

double normal(double off, double sigma) {
  return std::exp(-0.5 * off * off / (sigma * sigma)) / (sigma * std::sqrt(2.0 * std::numbers::pi));
}

}  // namespace

void DiameterStatistics::add(double diameter_m) {
  if (!(diameter_m > 0.0)) return;
  const double value = std::log(diameter_m);
  count_ += 1.0;
  const double off = value - mean_;
  mean_ += off / count_;
  squares_ += off * (value - mean_);
}

DiameterSpread DiameterStatistics::spread() const {
  if (count_ < kLeastDiameters) return {};
  return {mean_, std::max(kLeastSpread, std::sqrt(squares_ / count_))};
}

StemView view_of(std::vector<LevelStem> stems) {
  StemView view;
  view.radius_m = extent_of(stems).radius_m;
  view.weight.assign(stems.size(), 1.0);
  view.stems = std::move(stems);
  return view;
}

StemLikelihood::StemLikelihood(StemView frame, const StemNoise& noise,
                               const DiameterSpread& diameters)
    : noise_(noise), diameters_(diameters), radius_m_(frame.radius_m) {
  double inside = 0.0;
  for (std::size_t i = 0; i < frame.stems.size(); ++i) {
    if (frame.stems[i].position_m.norm() <= radius_m_) inside += frame.weight[i];
  }
  const double density = inside / (std::numbers::pi * radius_m_ * radius_m_);
  const double crowd_area = std::numbers::pi * kCrowdRadiusM * kCrowdRadiusM;

  prepared_.reserve(frame.stems.size());
  for (std::uint32_t i = 0; i < frame.stems.size(); ++i) {
    const LevelStem& stem = frame.stems[i];
    const bool has_diameter = stem.diameter_m > 0.0;
    prepared_.push_back({stem.position_m, i, has_diameter ? std::log(stem.diameter_m) : 0.0,
                         has_diameter, frame.weight[i], density});
  }
  std::ranges::sort(prepared_, {}, [](const FrameStem& stem) { return stem.position_m.x(); });
  for (const FrameStem& stem : prepared_) x_m_.push_back(stem.position_m.x());

  for (FrameStem& stem : prepared_) {
    double around = 0.0;
    for (const FrameStem& other : strip(stem.position_m, kCrowdRadiusM)) {
      const double squared = (other.position_m - stem.position_m).squaredNorm();
      if (squared < kCrowdRadiusM * kCrowdRadiusM) around += other.weight;
    }
    stem.density_per_m2 = std::max(density, around / crowd_area);
  }
}

std::span<const StemLikelihood::FrameStem> StemLikelihood::strip(const Eigen::Vector2d& point_m,
                                                                 double reach_m) const {
  const auto first = std::ranges::lower_bound(x_m_, point_m.x() - reach_m);
  auto end = first;
  while (end != x_m_.end() && *end <= point_m.x() + reach_m) ++end;
  return std::span(prepared_).subspan(static_cast<std::size_t>(first - x_m_.begin()),
                                      static_cast<std::size_t>(end - first));
}

std::vector<StemLikelihood::QueryDiameter> StemLikelihood::diameters_of(
    std::span<const LevelStem> query) const {
  std::vector<QueryDiameter> result(query.size());
  if (!noise_.use_diameters) return result;
  for (std::size_t i = 0; i < query.size(); ++i) {
    if (!(query[i].diameter_m > 0.0)) continue;
    const double log = std::log(query[i].diameter_m);
    const double anywhere = 0.95 * normal(log - diameters_.mean, diameters_.sigma) +
                            0.05 * normal(log - diameters_.mean, 2.0 * diameters_.sigma + 0.5);
    result[i] = {true, log, anywhere};
  }
  return result;
}

double StemLikelihood::diameter_ratio(const QueryDiameter& query, const FrameStem& stem) const {
  if (!query.is_known || !stem.has_diameter) return 1.0;
  const double off = query.log - stem.log_diameter;
  const double right = (1.0 - noise_.wide_diameter_share) * normal(off, noise_.diameter_log_sigma) +
                       noise_.wide_diameter_share * normal(off, noise_.wide_diameter_log_sigma);
  return right / query.anywhere;
}

Eigen::Vector2d StemLikelihood::weight(const QueryDiameter& query, const FrameStem& stem,
                                       double squared_m2, const Kernel& kernel) const {
  const double scale = noise_.matched_share * stem.weight * diameter_ratio(query, stem) /
                       (stem.density_per_m2 * 2.0 * std::numbers::pi);
  return {scale * (1.0 - noise_.wide_share) / kernel.narrow_variance *
              std::exp(-0.5 * squared_m2 / kernel.narrow_variance),
          scale * noise_.wide_share / kernel.wide_variance *
              std::exp(-0.5 * squared_m2 / kernel.wide_variance)};
}

double StemLikelihood::log_ratio(std::span<const LevelStem> query,
                                 const geometry::SE2& frame_T_query) const {
  const Kernel kernel{noise_.sigma_m * noise_.sigma_m, noise_.wide_sigma_m * noise_.wide_sigma_m};
  const double far_m = kFarSigmas * noise_.wide_sigma_m;
  const Eigen::Matrix2d rotation = frame_T_query.rotation();
  const double inside_m2 = radius_m_ * radius_m_;

  const std::vector<QueryDiameter> diameters = diameters_of(query);
  double sum = 0.0;
  for (std::size_t i = 0; i < query.size(); ++i) {
    const LevelStem& stem = query[i];
    const Eigen::Vector2d mapped = rotation * stem.position_m + frame_T_query.translation();
    if (mapped.squaredNorm() > inside_m2) continue;
    double ratio = 1.0 - noise_.matched_share;
    for (const FrameStem& other : strip(mapped, far_m)) {
      const double squared = (other.position_m - mapped).squaredNorm();
      if (squared < far_m * far_m) ratio += weight(diameters[i], other, squared, kernel).sum();
    }
    sum += std::log(ratio);
  }
  return sum;
}

geometry::SE2 StemLikelihood::refined(std::span<const LevelStem> query,
                                      const geometry::SE2& start) const {
  const std::vector<QueryDiameter> diameters = diameters_of(query);
  geometry::SE2 pose = start;
  for (const RefineSpread& spread : kSpreads) {
    const Eigen::Matrix2d rotation = pose.rotation();
    geometry::RigidAlignment2 sums;
    for (std::size_t own = 0; own < query.size(); ++own) {
      const LevelStem& stem = query[own];
      const Eigen::Vector2d mapped = rotation * stem.position_m + pose.translation();
      const double lever = spread.per_metre * stem.position_m.norm();
      const double added = spread.on_the_spot_m * spread.on_the_spot_m + lever * lever;
      const Kernel kernel{noise_.sigma_m * noise_.sigma_m + added,
                          noise_.wide_sigma_m * noise_.wide_sigma_m + added};
      const double far_m = kFarSigmas * std::sqrt(kernel.wide_variance);

      double ratio = 1.0 - noise_.matched_share;
      std::array<std::pair<const FrameStem*, Eigen::Vector2d>, 8> near{};
      std::size_t count = 0;
      for (const FrameStem& other : strip(mapped, far_m)) {
        const double squared = (other.position_m - mapped).squaredNorm();
        if (squared > far_m * far_m || count == near.size()) continue;
        near[count] = {&other, weight(diameters[own], other, squared, kernel)};
        ratio += near[count++].second.sum();
      }
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector2d share = near[i].second / ratio;
        sums.add(near[i].first->position_m, stem.position_m,
                 share.x() / kernel.narrow_variance + share.y() / kernel.wide_variance);
      }
    }
    if (!(sums.weight() > 0.0)) return pose;
    pose = sums.a_T_b();
  }
  return pose;
}

std::vector<StemPair> StemLikelihood::pairs(std::span<const LevelStem> query,
                                            const geometry::SE2& frame_T_query,
                                            double gate_m) const {
  const Eigen::Matrix2d rotation = frame_T_query.rotation();
  std::vector<std::uint32_t> nearest_query(prepared_.size(), 0);
  std::vector<double> nearest_m2(prepared_.size(), gate_m * gate_m);
  std::vector<StemPair> found;
  found.reserve(query.size());
  for (std::uint32_t i = 0; i < query.size(); ++i) {
    const Eigen::Vector2d mapped = rotation * query[i].position_m + frame_T_query.translation();
    StemPair pair{i, 0, std::numeric_limits<double>::infinity()};
    for (const FrameStem& other : strip(mapped, gate_m)) {
      const double squared = (other.position_m - mapped).squaredNorm();
      if (squared < nearest_m2[other.number]) {
        nearest_m2[other.number] = squared;
        nearest_query[other.number] = i;
      }
      if (squared < pair.distance_m) pair = {i, other.number, squared};
    }
    if (pair.distance_m < gate_m * gate_m) found.push_back(pair);
  }

  std::erase_if(found,
                [&](const StemPair& pair) { return nearest_query[pair.frame] != pair.query; });
  for (StemPair& pair : found) pair.distance_m = std::sqrt(pair.distance_m);
  return found;
}

Eigen::Matrix3d StemLikelihood::covariance(std::span<const LevelStem> query,
                                           const geometry::SE2& pose,
                                           std::span<const StemPair> pairs) const {
  if (pairs.size() < 2) return kUnknownVariance * Eigen::Matrix3d::Identity();
  double squared = 0.0;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const StemPair& pair : pairs) {
    Eigen::Matrix<double, 2, 3> j;
    j << pose.rotation(), pose.rotation() * geometry::perpendicular(query[pair.query].position_m);
    sum += j.transpose() * j;
    squared += pair.distance_m * pair.distance_m;
  }
  const double seen =
      pairs.size() > 2 ? squared / (2.0 * static_cast<double>(pairs.size()) - 3.0) : 0.0;
  const double variance = std::max(seen, noise_.sigma_m * noise_.sigma_m);
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(sum);
  if (!solver.isInvertible()) return kUnknownVariance * Eigen::Matrix3d::Identity();
  return variance * solver.inverse();
}

}  // namespace understory::place_recognition
