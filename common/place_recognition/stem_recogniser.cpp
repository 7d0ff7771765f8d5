#include "common/place_recognition/stem_recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "common/place_recognition/hypotheses.hpp"

namespace understory::place_recognition {
namespace {

/// Size of distinct poses, for the number of poses available to chance [m], [rad].
constexpr double kPoseCellM = 0.1;
constexpr double kPoseCellRad = 0.01;
/// Least log likelihood ratio for two frames at one place, if the query already implies it, and if
/// not.
constexpr double kAgreeing = 12.0;
constexpr double kAgreeingByItself = 35.0;
/// Two poses of one query in one frame are the same within this [m], [rad].
constexpr double kSamePoseM = 0.4;
constexpr double kSamePoseRad = 0.05;

bool same_pose(const geometry::SE2& a, const geometry::SE2& b) {
  const Eigen::Vector3d off = (a.inverse() * b).Log();
  return off.head<2>().norm() < kSamePoseM && std::abs(off.z()) < kSamePoseRad;
}

/// Sorts candidates, the likeliest first, one for each frame.
void sort_candidates(std::vector<PlaceCandidate>& candidates) {
  std::ranges::sort(candidates, [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return std::tuple(a.frame, -a.log_ratio) < std::tuple(b.frame, -b.log_ratio);
  });
  const auto same = std::unique(
      candidates.begin(), candidates.end(),
      [](const PlaceCandidate& a, const PlaceCandidate& b) { return a.frame == b.frame; });
  candidates.erase(same, candidates.end());
  std::ranges::sort(candidates, [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return std::tuple(-a.log_ratio, a.frame) < std::tuple(-b.log_ratio, b.frame);
  });
}

}  // namespace

/// The frames, their triangles and their chains.
class StemRecogniser::Index {
 public:
  explicit Index(const StemRecogniserParameters& parameters)
      : parameters_(parameters),
        triangles_(parameters.side_tolerance_m),
        chains_(parameters.chains, parameters.triangles, parameters.noise) {}

  void add(FrameId id, std::span<const LevelStem> stems) {
    const PackedStems packed(stems);
    const std::vector<LevelStem> kept = packed.unpacked();
    for (const LevelStem& stem : kept) diameters_.add(stem.diameter_m);
    triangles_.add(kept, stem_triangles(kept, parameters_.triangles));
    chains_.add(packed, diameters_.spread());
    ids_.push_back(id);
  }

  PlaceAnswer query(std::span<const LevelStem> given, FrameId newest) const {
    const std::vector<LevelStem> stems = PackedStems(given).unpacked();
    const Query query{stems, index_after(newest)};
    PlaceAnswer answer;
    if (query.end == 0 || stems.size() < 3) return answer;
    compare_frames(query, answer.candidates);
    compare_views(query, answer.candidates);
    rate(query, answer.candidates);
    choose_nearest(query, answer);
    return answer;
  }

  std::size_t size() const { return ids_.size(); }
  std::size_t stored_bytes() const {
    std::size_t bytes = ids_.size() * sizeof(FrameId);
    for (std::size_t i = 0; i < ids_.size(); ++i) bytes += chains_.stems(i).bytes();
    return bytes;
  }

 private:
  /// A query over frames before the index `end`.
  struct Query {
    const std::vector<LevelStem>& stems;
    std::size_t end = 0;
  };

  std::size_t index_after(FrameId newest) const {
    return static_cast<std::size_t>(std::ranges::upper_bound(ids_, newest) - ids_.begin());
  }
  std::size_t index_of(FrameId id) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(ids_, id) - ids_.begin());
  }
  StemLikelihood frame_alone(std::size_t frame) const {
    return {view_of(chains_.stems(frame).unpacked()), parameters_.noise, diameters_.spread()};
  }
  StemLikelihood frame_in_chain(std::size_t frame, std::size_t end) const {
    return {chains_.view(frame, end), parameters_.noise, diameters_.spread()};
  }

  /// The clusters with the most votes over all frames.
  std::vector<PlaceCluster> clusters(const Query& query) const {
    HypothesisFilter filter;
    filter.side_tolerance_m = parameters_.side_tolerance_m;
    filter.max_distance_m = parameters_.max_distance_m;
    filter.end = static_cast<std::uint32_t>(query.end);
    if (parameters_.noise.use_diameters)
      filter.diameter_log_tolerance = parameters_.diameter_log_tolerance;
    const std::vector<Hypothesis> all = triangles_.hypotheses(
        query.stems, stem_triangles(query.stems, parameters_.triangles), filter);

    std::vector<PlaceCluster> found;
    for (std::size_t begin = 0; begin < all.size();) {
      std::size_t end = begin;
      while (end < all.size() && all[end].frame == all[begin].frame) ++end;
      collect_clusters(std::span(all).subspan(begin, end - begin), found);
      begin = end;
    }
    std::ranges::stable_sort(found, std::greater(), &PlaceCluster::votes);
    found.resize(std::min(found.size(), parameters_.most_frames));
    return found;
  }

  /// Compares the query with each frame's own stems.
  void compare_frames(const Query& query, std::vector<PlaceCandidate>& candidates) const {
    for (const PlaceCluster& cluster : clusters(query)) {
      const StemLikelihood frame = frame_alone(cluster.frame);
      PlaceCandidate candidate;
      candidate.frame = ids_[cluster.frame];
      candidate.votes = cluster.votes;
      candidate.frame_T_query = frame.refined(query.stems, cluster.frame_T_query);
      candidate.log_ratio = frame.log_ratio(query.stems, candidate.frame_T_query);
      candidates.push_back(std::move(candidate));
    }
    sort_candidates(candidates);
    candidates.resize(std::min(candidates.size(), parameters_.most_views));
  }

  /// Compares the best ones with the views around their frames.
  void compare_views(const Query& query, std::vector<PlaceCandidate>& candidates) const {
    for (PlaceCandidate& candidate : candidates)
      refine_in_chain(query, index_of(candidate.frame), candidate);
    sort_candidates(candidates);
  }

  void refine_in_chain(const Query& query, std::size_t frame, PlaceCandidate& candidate) const {
    const StemLikelihood view = frame_in_chain(frame, query.end);
    candidate.frame_T_query = view.refined(query.stems, candidate.frame_T_query);
    candidate.log_ratio = view.log_ratio(query.stems, candidate.frame_T_query);
    const auto around = view.pairs(query.stems, candidate.frame_T_query, parameters_.gate_m);
    candidate.covariance = view.covariance(query.stems, candidate.frame_T_query, around);
    candidate.pairs =
        frame_alone(frame).pairs(query.stems, candidate.frame_T_query, parameters_.gate_m);
  }

  void rate(const Query& query, std::span<PlaceCandidate> candidates) const {
    const double reach = parameters_.max_distance_m / kPoseCellM;
    const double poses = static_cast<double>(query.end) * std::numbers::pi * reach * reach *
                         (2.0 * std::numbers::pi / kPoseCellRad);
    for (PlaceCandidate& candidate : candidates)
      candidate.log10_false_alarm = std::log10(poses) - candidate.log_ratio / std::numbers::ln10;
  }

  /// The pose of the query in the frame of `b` by candidate `a`, if both place the query equally:
  /// the frames are in one chain, or their stems agree.
  std::optional<geometry::SE2> agreed_pose(const Query& query, const PlaceCandidate& a,
                                           const PlaceCandidate& b) const {
    const std::size_t first = index_of(a.frame);
    const std::size_t second = index_of(b.frame);
    std::optional<geometry::SE2> first_T_second = chains_.between(first, second);
    if (!first_T_second) {
      const StemLikelihood view = frame_in_chain(first, query.end);
      const std::vector<LevelStem> other = chains_.stems(second).unpacked();
      const geometry::SE2 refined =
          view.refined(other, a.frame_T_query * b.frame_T_query.inverse());
      // A frame that fits the query by chance also fits other frames with these stems.
      const double least = b.log10_false_alarm < 0.0 ? kAgreeing : kAgreeingByItself;
      if (view.log_ratio(other, refined) > least) first_T_second = refined;
    }
    if (!first_T_second) return std::nullopt;
    const geometry::SE2 pose = first_T_second->inverse() * a.frame_T_query;
    return same_pose(pose, b.frame_T_query) ? std::optional(pose) : std::nullopt;
  }

  /// Adds frames of the likeliest one's chain that were taken nearer to the query but not found by
  /// triangles.
  void add_nearer_of_chain(const Query& query, PlaceAnswer& answer) const {
    const PlaceCandidate likeliest = answer.candidates.front();
    const std::size_t own = index_of(likeliest.frame);
    const std::size_t reach = 2 * chains_.reach();
    double nearest_m = likeliest.frame_T_query.translation().norm();
    std::optional<PlaceCandidate> found;
    for (std::size_t i = own - std::min(own, reach); i < std::min(query.end, own + reach + 1);
         ++i) {
      const auto frame_T_own = chains_.between(i, own);
      if (!frame_T_own) continue;
      const geometry::SE2 pose = *frame_T_own * likeliest.frame_T_query;
      if (pose.translation().norm() >= nearest_m) continue;
      nearest_m = pose.translation().norm();
      found = likeliest;
      found->frame = ids_[i];
      found->frame_T_query = pose;
    }
    if (!found) return;

    // The evidence is that of the chain, not of the frame itself.
    const geometry::SE2 predicted = found->frame_T_query;
    refine_in_chain(query, index_of(found->frame), *found);
    if (!same_pose(predicted, found->frame_T_query)) found->frame_T_query = predicted;
    found->log_ratio = likeliest.log_ratio;
    found->log10_false_alarm = likeliest.log10_false_alarm;
    std::erase_if(answer.candidates,
                  [&](const PlaceCandidate& other) { return other.frame == found->frame; });
    answer.candidates.insert(answer.candidates.begin() + 1, *found);
  }

  void choose_nearest(const Query& query, PlaceAnswer& answer) const {
    if (answer.candidates.empty()) return;
    add_nearer_of_chain(query, answer);
    const PlaceCandidate& likeliest = answer.candidates.front();
    double nearest_m = likeliest.frame_T_query.translation().norm();
    double rival = 0.0;
    for (std::size_t i = 1; i < answer.candidates.size(); ++i) {
      PlaceCandidate& other = answer.candidates[i];
      if (!(other.log_ratio > 0.0)) break;
      const bool may_be_nearer = other.frame_T_query.translation().norm() < nearest_m + kSamePoseM;
      if (!may_be_nearer && rival > 0.0) continue;
      const auto agreed = agreed_pose(query, likeliest, other);
      if (!agreed) {
        rival = std::max(rival, other.log_ratio);
        continue;
      }
      if (other.log10_false_alarm >= 0.0) other.frame_T_query = *agreed;
      if (other.frame_T_query.translation().norm() >= nearest_m) continue;
      nearest_m = other.frame_T_query.translation().norm();
      answer.nearest = i;
    }
    answer.log10_margin = (likeliest.log_ratio - rival) / std::numbers::ln10;
    if (nearest_m > parameters_.radius_m) prefer_within_radius(answer);
  }

  /// If the likeliest candidate may be chance, and no agreeing frame is within the radius, the
  /// likeliest candidate within it is the better guess.
  void prefer_within_radius(PlaceAnswer& answer) const {
    if (answer.candidates.front().log10_false_alarm < 0.0) return;
    const auto within = std::ranges::find_if(answer.candidates, [&](const PlaceCandidate& one) {
      return one.frame_T_query.translation().norm() <= parameters_.radius_m;
    });
    if (within == answer.candidates.end()) return;
    answer.nearest = static_cast<std::size_t>(within - answer.candidates.begin());
    answer.log10_margin =
        (within->log_ratio - answer.candidates.front().log_ratio) / std::numbers::ln10;
  }

  StemRecogniserParameters parameters_;
  std::vector<FrameId> ids_;
  TripletIndex triangles_;
  StemChains chains_;
  DiameterStatistics diameters_;
};

StemRecogniser::StemRecogniser(const StemRecogniserParameters& parameters)
    : index_(std::make_unique<Index>(parameters)) {}
StemRecogniser::~StemRecogniser() = default;
StemRecogniser::StemRecogniser(StemRecogniser&&) noexcept = default;
StemRecogniser& StemRecogniser::operator=(StemRecogniser&&) noexcept = default;

void StemRecogniser::add(FrameId id, std::span<const LevelStem> stems) { index_->add(id, stems); }
PlaceAnswer StemRecogniser::query(std::span<const LevelStem> stems, FrameId newest) const {
  return index_->query(stems, newest);
}
std::size_t StemRecogniser::size() const { return index_->size(); }
std::size_t StemRecogniser::stored_bytes() const { return index_->stored_bytes(); }

}  // namespace understory::place_recognition
