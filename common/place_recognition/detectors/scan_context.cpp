#include "common/place_recognition/detectors/scan_context.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/place_recognition/detectors/linear_detector.hpp"

namespace understory::place_recognition::detectors {
namespace {

/// Steps of a packed value from 0 to 1.
constexpr float kPackedSteps = 255.0F;

using Values = Eigen::Map<const Eigen::VectorXf>;

double dot(std::span<const float> a, std::span<const float> b) {
  const auto size = static_cast<Eigen::Index>(a.size());
  return static_cast<double>(Values(a.data(), size).dot(Values(b.data(), size)));
}

/// Marks the sectors that are not empty.
std::vector<char> occupied_sectors(const ScanContext& context, std::size_t rings) {
  std::vector<char> occupied(context.columns.size() / rings);
  for (std::size_t j = 0; j < occupied.size(); ++j) {
    const auto column = std::span(context.columns).subspan(j * rings, rings);
    occupied[j] = std::any_of(column.begin(), column.end(), [](float x) { return x > 0.0F; });
  }
  return occupied;
}

void normalise(std::span<float> column) {
  double squared = 0.0;
  for (const float x : column) squared += static_cast<double>(x) * static_cast<double>(x);
  if (squared == 0.0) return;
  const double scale = 1.0 / std::sqrt(squared);
  for (float& x : column) x = static_cast<float>(scale * static_cast<double>(x));
}

}  // namespace

std::optional<ScanContext> ScanContextMaker::describe(std::span<const Eigen::Vector3f> points,
                                                      const Eigen::Vector2d& origin_m) const {
  const std::size_t rings = parameters_.rings;
  const std::size_t sectors = parameters_.sectors;
  ScanContext context;
  context.columns.assign(rings * sectors, 0.0F);
  bool is_empty = true;
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector2d at = point.head<2>().cast<double>() - origin_m;
    const double range = at.norm() / parameters_.max_range_m * static_cast<double>(rings);
    const double height = static_cast<double>(point.z()) + parameters_.lift_m;
    if (!(range < static_cast<double>(rings)) || !(height > 0.0)) continue;

    const double turn = std::atan2(at.y(), at.x()) / (2.0 * std::numbers::pi);
    const double sector = (turn < 0.0 ? turn + 1.0 : turn) * static_cast<double>(sectors);
    const std::size_t j = std::min(sectors - 1, static_cast<std::size_t>(sector));
    float& bin = context.columns[j * rings + static_cast<std::size_t>(range)];
    bin = std::max(bin, static_cast<float>(height));
    is_empty = false;
  }
  if (is_empty) return std::nullopt;

  context.ring_key.assign(rings, 0.0F);
  for (std::size_t i = 0; i < context.columns.size(); ++i)
    context.ring_key[i % rings] += context.columns[i] > 0.0F ? 1.0F : 0.0F;
  for (float& share : context.ring_key) share /= static_cast<float>(sectors);
  for (std::size_t j = 0; j < sectors; ++j)
    normalise(std::span(context.columns).subspan(j * rings, rings));
  return context;
}

ContextDistance ScanContextMaker::distance(const ScanContext& query,
                                           const ScanContext& frame) const {
  const std::size_t rings = parameters_.rings;
  const std::size_t sectors = parameters_.sectors;
  const std::vector<char> of_query = occupied_sectors(query, rings);
  const std::vector<char> of_frame = occupied_sectors(frame, rings);
  const std::span<const float> from(query.columns);
  const std::span<const float> to(frame.columns);

  ContextDistance best{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t shift = 0; shift < sectors; ++shift) {
    std::size_t counted = 0;
    for (std::size_t j = 0; j < sectors; ++j) {
      const std::size_t other = j + shift < sectors ? j + shift : j + shift - sectors;
      counted += (of_query[j] | of_frame[other]) != 0 ? 1 : 0;
    }
    const std::size_t straight = (sectors - shift) * rings;
    const double cosines = dot(from.first(straight), to.subspan(shift * rings)) +
                           dot(from.subspan(straight), to.first(shift * rings));
    const double distance = 1.0 - cosines / static_cast<double>(std::max<std::size_t>(1, counted));
    if (distance < best.distance) best = {distance, shift};
  }
  return best;
}

double ScanContextMaker::key_distance(std::span<const float> a, std::span<const float> b) const {
  const auto rings = static_cast<Eigen::Index>(parameters_.rings);
  return static_cast<double>((Values(a.data(), rings) - Values(b.data(), rings)).norm());
}

double ScanContextMaker::heading_rad(std::size_t shift) const {
  return geometry::wrap_angle(2.0 * std::numbers::pi * static_cast<double>(shift) /
                              static_cast<double>(parameters_.sectors));
}

double ScanContextMaker::heading_sigma_rad(double place_sigma_m) const {
  return std::hypot(2.0 * std::numbers::pi / static_cast<double>(parameters_.sectors),
                    place_sigma_m / (0.5 * parameters_.max_range_m));
}

std::vector<ShiftedContext> shifted_contexts(const ScanContextMaker& maker,
                                             const PlaceFrame& frame) {
  const std::vector<Eigen::Vector3f> points = points_of(frame);
  const int most = static_cast<int>(maker.parameters().root_shifts);
  std::vector<ShiftedContext> found;
  for (int k = -most; k <= most; ++k) {
    const double left_m = k * maker.parameters().root_shift_m;
    if (auto context = maker.describe(points, {0.0, left_m}))
      found.push_back({std::move(*context), left_m});
  }
  return found;
}

BestContext best_context(const ScanContextMaker& maker, std::span<const ShiftedContext> query,
                         const ScanContext& frame) {
  BestContext best{std::numeric_limits<double>::infinity(), {}};
  for (const ShiftedContext& shifted : query) {
    const ContextDistance found = maker.distance(shifted.context, frame);
    if (found.distance >= best.distance) continue;
    best.distance = found.distance;
    best.frame_T_query = geometry::SE2(0.0, 0.0, maker.heading_rad(found.shift)) *
                         geometry::SE2(0.0, -shifted.left_m, 0.0);
  }
  return best;
}

PackedContext packed(const ScanContext& context) {
  PackedContext result{std::vector<std::uint8_t>(context.columns.size()), context.ring_key};
  std::ranges::transform(context.columns, result.columns.begin(), [](float value) {
    const long steps = std::lround(value * kPackedSteps);
    // A low value is not an empty bin.
    return static_cast<std::uint8_t>(value > 0.0F ? std::max(1L, steps) : 0L);
  });
  return result;
}

ScanContext unpacked(const PackedContext& context) {
  ScanContext result{std::vector<float>(context.columns.size()), context.ring_key};
  std::ranges::transform(context.columns, result.columns.begin(), [](std::uint8_t steps) {
    return static_cast<float>(steps) / kPackedSteps;
  });
  return result;
}

ScanContextDetector::ScanContextDetector(const ScanContextParameters& parameters,
                                         double place_sigma_m)
    : maker_(parameters), place_sigma_m_(place_sigma_m) {}

void ScanContextDetector::add(const PlaceFrame& frame) {
  ids_.push_back(frame.id);
  const auto context = maker_.describe(points_of(frame), Eigen::Vector2d::Zero());
  contexts_.push_back(context ? std::optional(packed(*context)) : std::nullopt);
}

/// Frames before the index `end` with the least distance to any of the query's keys.
std::vector<std::size_t> ScanContextDetector::nearest_keys(std::span<const ShiftedContext> query,
                                                           std::size_t end) const {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < end; ++i) {
    if (!contexts_[i]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const ShiftedContext& shifted : query)
      least =
          std::min(least, maker_.key_distance(shifted.context.ring_key, contexts_[i]->ring_key));
    order.emplace_back(least, i);
  }

  const std::size_t kept = std::min(order.size(), maker_.parameters().ring_candidates);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end());
  std::vector<std::size_t> nearest(kept);
  for (std::size_t i = 0; i < kept; ++i) nearest[i] = order[i].second;
  return nearest;
}

std::vector<ScoredPlace> ScanContextDetector::query(const PlaceFrame& frame,
                                                    const PlaceQuery& limits) const {
  const std::vector<ShiftedContext> query = shifted_contexts(maker_, frame);
  std::vector<ScoredPlace> places;
  if (query.empty()) return places;

  const auto end = static_cast<std::size_t>(
      std::upper_bound(ids_.begin(), ids_.end(), limits.newest) - ids_.begin());
  const double sigma_rad = maker_.heading_sigma_rad(place_sigma_m_);
  for (const std::size_t i : nearest_keys(query, end)) {
    const BestContext best = best_context(maker_, query, unpacked(*contexts_[i]));
    places.push_back(
        {ids_[i], -best.distance, {heading_guess(best.frame_T_query, place_sigma_m_, sigma_rad)}});
  }
  keep_best(places, limits.most);
  return places;
}

std::size_t ScanContextDetector::descriptor_bytes() const {
  const std::size_t of_one = maker_.parameters().rings *
                             (maker_.parameters().sectors * sizeof(std::uint8_t) + sizeof(float));
  return of_one * static_cast<std::size_t>(std::count_if(contexts_.begin(), contexts_.end(),
                                                         [](const auto& one) { return !!one; }));
}

}  // namespace understory::place_recognition::detectors
