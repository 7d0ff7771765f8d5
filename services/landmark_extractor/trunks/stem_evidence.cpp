#include "services/landmark_extractor/trunks/stem_evidence.hpp"

#include <algorithm>
#include <array>

#include "services/landmark_extractor/square.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

constexpr std::size_t kHitsPerRun = 7;
static_assert(kHitsPerRun <= kLanes);

}  // namespace

void StemEvidence::summarise(const std::vector<rings::Run>& runs, const Column& column) {
  anchor_m_ = column.centre_m;
  summaries_.clear();
  for (const std::uint32_t index : column.runs) {
    const rings::Run& run = runs[index];
    const std::size_t hits = std::min(run.size(), kHitsPerRun);
    summaries_.push_back({index, run.x_m, run.y_m, run.z_m, run.width_m, run.nearest_m,
                          static_cast<float>(run.size()), run.ring,
                          static_cast<std::uint16_t>(hits / 2)});
  }
}

void StemEvidence::take(const rings::RingCloud& cloud, const std::vector<rings::Run>& runs) {
  const std::size_t count = summaries_.size();
  hits_.assign(count, {});
  edges_.assign((2 * count + kLanes - 1) / kLanes, {});
  for (EdgeLanes& group : edges_) group.variance.fill(1.0F);
  for (std::size_t k = 0; k < count; ++k) {
    const rings::Run& run = runs[summaries_[k].index];
    add_hits(cloud, run, hits_[k]);
    EdgeLanes& edges = edges_[2 * k / kLanes];
    const std::size_t lane = 2 * k % kLanes;
    if (run.left == planar::Border::kClear) add_edge(cloud, run, 1.0F, edges, lane);
    if (run.right == planar::Border::kClear) add_edge(cloud, run, -1.0F, edges, lane + 1);
  }
}

/// Adds some of its points, distributed over the run.
void StemEvidence::add_hits(const rings::RingCloud& cloud, const rings::Run& run,
                            HitLanes& hits) const {
  const std::size_t count = std::min(run.size(), kHitsPerRun);
  for (std::size_t k = 0; k < count; ++k) {
    const points::RingPoint& point =
        cloud.points()[run.first + (2 * k + 1) * run.size() / (2 * count)];
    const rings::Sight sight = cloud.sight(point);
    hits.origin_x[k] = static_cast<float>(sight.origin_m.x() - anchor_m_.x());
    hits.origin_y[k] = static_cast<float>(sight.origin_m.y() - anchor_m_.y());
    hits.along_x[k] = static_cast<float>(sight.direction.x());
    hits.along_y[k] = static_cast<float>(sight.direction.y());
    hits.range[k] = point.range_m;
    hits.z[k] = point.z_m;
    hits.counts[k] = 1.0F;
  }
}

/// The edge lies between the run's last beam and the next; if that gave no return and may have been
/// lost, also between that and the one after it.
void StemEvidence::add_edge(const rings::RingCloud& cloud, const rings::Run& run, float side,
                            EdgeLanes& edges, std::size_t lane) const {
  const points::RingPoint& last = cloud.points()[side > 0.0F ? run.last : run.first];
  const double step = cloud.step_rad(run.ring);
  const bool is_silent = side > 0.0F ? run.is_left_silent : run.is_right_silent;
  const double lost = is_silent ? lost_share_ : 0.0;
  const double beyond = side * ((0.5 + lost) * step - sweep_.beam_width_rad);

  rings::Sight sight = cloud.sight(last);
  sight.direction += beyond * Eigen::Vector2d(-sight.direction.y(), sight.direction.x());
  sight.direction.normalize();

  edges.origin_x[lane] = static_cast<float>(sight.origin_m.x() - anchor_m_.x());
  edges.origin_y[lane] = static_cast<float>(sight.origin_m.y() - anchor_m_.y());
  edges.along_x[lane] = static_cast<float>(sight.direction.x());
  edges.along_y[lane] = static_cast<float>(sight.direction.y());
  edges.z[lane] = last.z_m;
  edges.side[lane] = side;
  edges.variance[lane] = static_cast<float>(square(static_cast<double>(last.range_m)) *
                                                (square(step) * (1.0 / 12.0 + lost * (1.0 - lost)) +
                                                 square(0.5 * sweep_.beam_width_rad)) +
                                            square(trunk_.roundness_sigma_m));
  edges.counts[lane] = 1.0F;
}

void AgreeingEvidence::select(const StemEvidence& evidence,
                              const std::vector<std::uint32_t>& places) {
  hits_.clear();
  edges_.clear();
  edge_count_ = 0;

  const std::size_t count = std::min(places.size(), kMaxRuns);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = places[i * places.size() / count];
    hits_.push_back(evidence.hits()[k]);
    const EdgeLanes& edges = evidence.edges()[2 * k / kLanes];
    use_edge(edges, 2 * k % kLanes);
    use_edge(edges, 2 * k % kLanes + 1);
  }
  share_edges();
}

void AgreeingEvidence::use_edge(const EdgeLanes& from, std::size_t lane) {
  if (from.counts[lane] == 0.0F) return;
  const std::size_t to_lane = edge_count_++ % kLanes;
  if (to_lane == 0) {
    edges_.emplace_back();
    edges_.back().variance.fill(1.0F);
  }

  EdgeLanes& to = edges_.back();
  to.origin_x[to_lane] = from.origin_x[lane];
  to.origin_y[to_lane] = from.origin_y[lane];
  to.along_x[to_lane] = from.along_x[lane];
  to.along_y[to_lane] = from.along_y[lane];
  to.z[to_lane] = from.z[lane];
  to.side[to_lane] = from.side[lane];
  to.variance[to_lane] = from.variance[lane];
  to.counts[to_lane] = 1.0F;
}

/// Rings that fire at the same azimuths have the same error of a fraction of a step at an upright
/// edge: together they measure no more than one does. Their common information is weighted by their
/// number, so that one ring that lost a beam at the edge does not outweigh all others.
/// At an edge that slants over M columns in N rings, the errors are not independent: they run
/// through the step, and their mean has a variance of 1 / (2 M^2) of a step's, or M / N^2 if that
/// is larger (within a fifth of a simulation of such lines).
void AgreeingEvidence::share_edges() {
  std::array<float, 2 * kMaxRuns> shares{};
  const float range2 = square(hits_.front().range[0]);
  const auto lane_of = [](std::size_t i) { return i % kLanes; };

  // Number of edges at the azimuth of each.
  for (std::size_t i = 0; i < edge_count_; ++i) {
    const EdgeLanes& a = edges_[i / kLanes];
    const std::size_t l = lane_of(i);
    for (std::size_t j = 0; j < edge_count_; ++j) {
      const EdgeLanes& b = edges_[j / kLanes];
      const std::size_t m = lane_of(j);
      const float apart = a.along_x[l] * b.along_y[m] - a.along_y[l] * b.along_x[m];
      const bool same = a.side[l] == b.side[m] && square(apart) * range2 < a.variance[l];
      shares[i] += same ? 1.0F : 0.0F;
    }
  }

  // Of each side: number of edges, and number of azimuths.
  std::array<float, 2> edges{};
  std::array<float, 2> places{};
  const auto side_of = [&](std::size_t i) {
    return edges_[i / kLanes].side[lane_of(i)] > 0.0F ? 1U : 0U;
  };
  for (std::size_t i = 0; i < edge_count_; ++i) {
    edges[side_of(i)] += 1.0F;
    places[side_of(i)] += 1.0F / shares[i];
  }

  // The variance of each.
  for (std::size_t i = 0; i < edge_count_; ++i) {
    const auto side = side_of(i);
    EdgeLanes& group = edges_[i / kLanes];
    const float per_place = edges[side] / places[side];
    group.variance[lane_of(i)] *= per_place;
    group.surplus[lane_of(i)] = 1.0F - std::max(0.5F / places[side], 1.0F / square(per_place));
  }
}

}  // namespace understory::landmark_extractor::trunks
