#include "services/loop_closer/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/state/archive.hpp"
#include "services/loop_closer/expectation.hpp"
#include "services/loop_closer/self_likeness.hpp"

namespace understory::loop_closer {
namespace {

constexpr state::Format kFormat{"loop_closer", 2};
/// First id of our closures: smaller ids are for closures set by hand.
constexpr std::uint64_t kFirstId = std::uint64_t{1} << 40;
/// If pairs are the only evidence for a place, it must have this many more pairs than a rival.
constexpr std::size_t kAheadOfRivals = 2;
/// Largest ratio of a wrong pose's evidence to the self-likeness of the two places: at most 1.6 was
/// measured for trees within 0.1 m of their grid, since the surroundings of a place hold more stems
/// than one window (docs/decisions/157).
constexpr double kOverSelfLikeness = 2.0;
/// Decades of self-likeness by chance of a place with few stems in a forest.
constexpr double kSelfLikenessByChance = 6.0;

bool is_placed(const model::MapUpdate& update) {
  return update.status == model::MapUpdateStatus::kFirstMap ||
         update.status == model::MapUpdateStatus::kUpdated;
}

/// The search uses the stems in their stored form: a restart gives the same results.
std::vector<LevelStem> as_kept(std::span<const LevelStem> stems) {
  return place_recognition::PackedStems(stems).unpacked();
}

/// The closure's end at a place, and the pose of its base relative to it.
model::LoopEnd end_at(const Place& place, geometry::SE2WithCovariance& end_T_base) {
  model::LoopEnd end;
  if (place.in_submap) {
    end.submap = place.in_submap->id;
    end_T_base = place.in_submap->submap_T_base;
  } else {
    end.keyframe = place.keyframe;
  }
  return end;
}

}  // namespace

LoopCloser::LoopCloser(const LoopCloserParameters& parameters)
    : parameters_(parameters),
      wants_clouds_(fault_of(parameters.search).empty() && wants_clouds(parameters.search)),
      window_(parameters.places),
      known_ground_(parameters.places.min_loop_m),
      search_(parameters.search, parameters.stems) {}

void LoopCloser::add(const model::Keyframe& keyframe) {
  pending_.push_back(keyframe);
  if (pending_.size() > kMostPending) pending_.pop_front();
}

void LoopCloser::add(const model::PlaceScan& scan) {
  if (wants_clouds_) clouds_.add(scan);
}

std::optional<model::Keyframe> LoopCloser::take_pending(std::uint64_t sequence) {
  while (!pending_.empty() && pending_.front().sequence < sequence) pending_.pop_front();
  if (pending_.empty() || pending_.front().sequence != sequence) return std::nullopt;
  model::Keyframe keyframe = std::move(pending_.front());
  pending_.pop_front();
  return keyframe;
}

std::optional<model::LoopClosure> LoopCloser::add(const model::MapUpdate& update) {
  const auto keyframe = take_pending(update.keyframe_sequence);
  if (!keyframe) ++counters_.keyframes_missing;
  if (!keyframe || !is_placed(update)) return std::nullopt;
  ++counters_.keyframes;

  if (update.map_id != map_id_) {
    map_id_ = update.map_id;
    window_.restart();
    known_ground_.restart();
  }
  if (window_.add(*keyframe, update) == WindowStep::kBegun) clouds_.restart();
  clouds_.add(*keyframe, update, window_.along_m());
  known_ground_.add(update, window_.along_m());
  if (window_.along_m() < place_at_m_) return std::nullopt;
  place_at_m_ = window_.along_m() + parameters_.places.every_m;
  if (known_ground_.is_known(parameters_.places.known_share)) return std::nullopt;

  std::optional<Place> place = place_here(update);
  if (!place) return std::nullopt;
  std::optional<model::LoopClosure> closure = look_for(*place);
  search_.add(*place);
  memory_.add(*std::move(place));
  ++counters_.places;
  return closure;
}

/// The place around the keyframe's base; none with too few stems.
std::optional<Place> LoopCloser::place_here(const model::MapUpdate& update) {
  Place place;
  place.keyframe = update.keyframe_sequence;
  place.utime = update.utime;
  place.map_id = update.map_id;
  place.along_m = window_.along_m();
  place.map_T_base = {update.map_T_vehicle, update.covariance};
  place.stems = as_kept(window_.stems());
  if (place.stems.size() < static_cast<std::size_t>(parameters_.places.min_stems))
    return std::nullopt;

  if (!wants_clouds_) return place;
  place.cloud =
      clouds_.seen_from(update.map_T_vehicle, place.along_m - parameters_.places.window_m);
  if (place.cloud.empty()) {
    ++counters_.without_cloud;
    return std::nullopt;
  }
  return place;
}

/// The most likely place, if no other explanation is plausible.
std::optional<model::LoopClosure> LoopCloser::look_for(const Place& place) {
  const std::size_t searched = memory_.count_until(place.along_m - parameters_.places.min_loop_m);
  if (searched == 0 || place.along_m < sent_.accepted_at_m() + parameters_.accept.closed_m)
    return std::nullopt;
  ++counters_.queries;
  const std::uint64_t newest = memory_.places()[searched - 1].keyframe;
  const std::vector<FoundPlace> found = search_.find(place, newest, memory_);
  if (found.empty()) return std::nullopt;

  const FoundPlace& best = found.front();
  const Place& from = *memory_.of_keyframe(best.keyframe);
  const Verdict verdict = judge(best, from, place, searched);
  const ClosurePaths paths{from.along_m, place.along_m};
  if (!verdict.is_sure || sent_.was_revoked(paths)) return std::nullopt;
  if (from.map_id != place.map_id) {
    ++counters_.other_map;
    return std::nullopt;
  }

  model::LoopClosure closure;
  closure.utime = place.utime;
  closure.map_id = place.map_id;
  closure.id = kFirstId + place.keyframe;
  closure.source = search_.source();
  geometry::SE2WithCovariance end_T_base;
  closure.from = end_at(from, end_T_base);
  closure.to.keyframe = place.keyframe;
  closure.from_T_to = compound(end_T_base, best.place_T_query);
  const double error_m = parameters_.places.error_m;
  const Eigen::Vector3d error(error_m, error_m, parameters_.places.error_rad);
  closure.from_T_to.covariance += Eigen::Matrix3d(error.array().square().matrix().asDiagonal());
  closure.log10_false_alarm = verdict.log10_false_alarm;
  sent_.add(closure.id, paths);
  ++counters_.sent;
  if (!verdict.is_expected) ++counters_.unexpected;
  return closure;
}

/// If the mapper's poses allow only few poses, less evidence against chance is needed. A pose
/// outside the expectation needs more evidence, and the mapper then waits for other closures that
/// agree. Without evidence from the detector the probability of chance is unknown: verified pairs
/// without a rival are required, and the mapper decides the rest.
LoopCloser::Verdict LoopCloser::judge(const FoundPlace& best, const Place& from, const Place& place,
                                      std::size_t searched) const {
  const AcceptanceParameters& accept = parameters_.accept;
  Verdict verdict;
  verdict.is_expected =
      from.map_id == place.map_id && squared_distance(expected(from, place), best.place_T_query) <=
                                         accept.gate_sigmas * accept.gate_sigmas;
  const bool has_pairs = best.pairs >= static_cast<std::size_t>(accept.min_pairs);
  if (!best.evidence) {
    verdict.is_sure = has_pairs && best.pairs >= best.rival_pairs + kAheadOfRivals;
    return verdict;
  }

  double poses = static_cast<double>(searched) * search_.poses_per_place();
  if (verdict.is_expected) {
    poses = std::min(poses, allowed_poses(memory_.places().first(searched), place,
                                          accept.gate_sigmas, search_.reach_m()));
  }

  verdict.log10_false_alarm =
      std::log10(std::max(1.0, poses)) - best.evidence->log_ratio / std::numbers::ln10;
  const double decades =
      verdict.is_expected ? accept.chance_decades_expected : accept.chance_decades;
  verdict.is_sure = verdict.log10_false_alarm <= -decades &&
                    best.evidence->margin_decades >= accept.margin_decades && has_pairs;
  if (!verdict.is_sure) return verdict;

  // In rows of stems a pose that is off by one row fits as well, and the best such pose has a
  // margin.
  const double likeness = std::max(self_likeness(place.stems, search_.stem_noise()),
                                   self_likeness(from.stems, search_.stem_noise()));
  verdict.log10_false_alarm += kOverSelfLikeness * std::max(0.0, likeness - kSelfLikenessByChance);
  verdict.is_sure = verdict.log10_false_alarm <= -decades;
  return verdict;
}

bool LoopCloser::add(const model::LoopResult& result) {
  using enum model::LoopResult::Status;
  if (!sent_.note(result)) return false;
  if (result.status == kAccepted) {
    ++counters_.accepted;
    window_.restart();
    clouds_.restart();
  }
  if (result.status == kWaiting) ++counters_.waiting;
  if (result.status == kRefused) ++counters_.refused;
  if (result.status == kRevoked) ++counters_.revoked;
  return true;
}

std::string LoopCloser::save() const { return state::save(kFormat, *this); }

void LoopCloser::load(const std::string& state) {
  LoopCloser loaded(parameters_);
  state::load(state, kFormat, loaded);
  for (const Place& place : loaded.memory_.places()) loaded.search_.add(place);
  *this = std::move(loaded);
}

}  // namespace understory::loop_closer
