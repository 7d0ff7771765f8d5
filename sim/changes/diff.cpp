#include "sim/changes/diff.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/changes/placing.hpp"
#include "sim/hash_random.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim::changes {
namespace {

using std::numbers::pi;

constexpr double kDiffSpacing = 0.25;  ///< Of the path, in the search for free space [m].
constexpr int kTriesForOccluder = 4000;
constexpr std::array<std::string_view, 4> kStateNames{"present", "gone", "moved", "new"};

/// Draws one diff, step by step.
class DiffMaker {
 public:
  DiffMaker(const Course& course, std::uint64_t seed, ThingId first_id)
      : scene_(course.scene),
        space_(free_space(course.scene, course.path.places_m(kDiffSpacing))),
        random_(mixed(seed, 0xd1ff)) {
    diff_.next_id = first_id > 0 ? first_id : course.scene.next_id;
  }

  /// Selects at random what is removed and what is moved.
  void change(const DiffParameters& parameters) {
    std::vector<const Thing*> chosen;
    for (const Thing& thing : scene_.things) {
      const bool is_meant = !parameters.only || thing.kind == *parameters.only;
      if (is_meant && thing.is_changeable()) chosen.push_back(&thing);
    }
    const auto count = static_cast<std::size_t>(
        std::lround(std::clamp(parameters.share, 0.0, 1.0) * static_cast<double>(chosen.size())));
    std::shuffle(chosen.begin(), chosen.end(), random_);
    chosen.resize(count);

    for (const Thing* thing : chosen) {
      const bool is_moved =
          thing->is_movable() && uniform(random_, 0.0, 1.0) < parameters.moved_share;
      if (!is_moved || !move(*thing, parameters.move_m)) remove(*thing);
    }
    std::sort(diff_.removed.begin(), diff_.removed.end());
    std::sort(diff_.moved.begin(), diff_.moved.end(),
              [](const Move& a, const Move& b) { return a.thing < b.thing; });
  }

  /// New things, of the kinds that were removed.
  void add(double per_removed) {
    const std::vector<ThingId> removed = diff_.removed;
    const auto count =
        static_cast<std::size_t>(std::lround(per_removed * static_cast<double>(removed.size())));
    for (std::size_t i = 0; i < count; ++i) {
      const ThingKind kind = scene_.find(removed[i % removed.size()])->kind;
      if (auto thing = place(scene_, kind, space_, random_)) take_in(*thing, diff_.added);
    }
  }

  void add_occluders(int count) {
    for (int i = 0; i < count; ++i) {
      auto thing = place(scene_, ThingKind::kLorry, space_, random_, kTriesForOccluder);
      if (thing) take_in(*thing, diff_.occluders);
    }
  }

  void remove(const Thing& thing) { diff_.removed.push_back(thing.id); }
  void add_occluder(Thing thing) { take_in(thing, diff_.occluders); }
  bool has_room(const Thing& thing) const { return space_.has_room(thing.extent); }
  std::span<const Eigen::Vector3d> path_m() const { return space_.path_m(); }
  std::mt19937_64& random() { return random_; }
  Diff take() { return std::move(diff_); }

 private:
  /// Its old space stays occupied: a map of both places could not distinguish them.
  bool move(const Thing& thing, double by_m) {
    for (int i = 0; i < 64; ++i) {
      const double bearing = uniform(random_, -pi, pi);
      Eigen::Vector3d by(by_m * std::cos(bearing), by_m * std::sin(bearing), 0.0);
      by.z() = scene_.ground->height((thing.extent.centre_m + by).head<2>()) -
               scene_.ground->height(thing.extent.centre_m.head<2>());
      const Thing there = moved(thing, by);
      if (!is_within(scene_, there.extent) || !has_room_beside_itself(there)) continue;
      space_.take(there.extent);
      placed_.push_back(there.extent);
      diff_.moved.push_back({thing.id, by});
      return true;
    }
    return false;
  }

  /// A short move overlaps the thing's old place, which must be ignored.
  bool has_room_beside_itself(const Thing& there) const {
    const double clearance = space_.clearance_m();
    const bool is_in_way = std::any_of(
        path_m().begin(), path_m().end(),
        [&](const Eigen::Vector3d& place) { return distance_m(there.extent, place) < clearance; });
    if (is_in_way) return false;
    const auto is_other_close = [&](const Thing& other) {
      return other.id != there.id && other.is_changeable() &&
             are_close(there.extent, other.extent, 0.0);
    };
    return std::none_of(scene_.things.begin(), scene_.things.end(), is_other_close) &&
           std::none_of(placed_.begin(), placed_.end(),
                        [&](const Box& box) { return are_close(there.extent, box, 0.0); });
  }

  void take_in(Thing& thing, std::vector<Thing>& things) {
    thing.id = diff_.next_id++;
    placed_.push_back(thing.extent);
    things.push_back(thing);
  }

  const Scene& scene_;
  FreeSpace space_;
  std::mt19937_64 random_;
  std::vector<Box> placed_;  ///< New and moved things.
  Diff diff_;
};

struct NearTree {
  double distance_m;
  const Thing* tree;
};

/// All trees by their distance from a point of the plan.
std::vector<NearTree> trees_by_distance(const Scene& scene, const Eigen::Vector2d& from_m) {
  std::vector<NearTree> trees;
  for (const Thing& thing : scene.things) {
    if (thing.kind != ThingKind::kTree) continue;
    trees.push_back({(thing.extent.centre_m.head<2>() - from_m).norm(), &thing});
  }
  std::sort(trees.begin(), trees.end(), [](const NearTree& a, const NearTree& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.tree->id < b.tree->id;
  });
  return trees;
}

/// Number of trees that a box hides from at least one point of the path within 25 m of it, at the
/// height of its middle.
int hidden_trees(const Box& box, std::span<const NearTree> trees,
                 std::span<const Eigen::Vector3d> path_m) {
  constexpr double kNear = 25.0;
  int count = 0;
  for (const NearTree& tree : trees) {
    const Eigen::Vector2d at = tree.tree->extent.centre_m.head<2>();
    if ((at - box.centre_m.head<2>()).norm() > kNear) continue;
    count += std::any_of(path_m.begin(), path_m.end(), [&](const Eigen::Vector3d& place) {
      const Eigen::Vector2d ray = at - place.head<2>();
      if (ray.norm() > kNear) return false;
      const Ray sight{{place.x(), place.y(), box.centre_m.z()},
                      Eigen::Vector3d(ray.x(), ray.y(), 0.0).normalized()};
      const auto hit = meet(sight, box);
      return hit && hit->range_m < ray.norm();
    });
  }
  return count;
}

/// The random lorry whose number of hidden trees is nearest to `wanted`.
Thing best_lorry(const Scene& scene, DiffMaker& maker, std::span<const NearTree> trees,
                 int wanted) {
  constexpr int kTries = 300;
  std::optional<Thing> best;
  int least_off = 0;
  for (int i = 0; i < kTries; ++i) {
    Thing lorry = propose(scene, ThingKind::kLorry, maker.path_m(), maker.random());
    if (!maker.has_room(lorry)) continue;
    const int off = std::abs(wanted - hidden_trees(lorry.extent, trees, maker.path_m()));
    if (best && off >= least_off) continue;
    best = std::move(lorry);
    least_off = off;
  }
  if (!best) throw std::runtime_error("no room for a lorry beside the path");
  return *best;
}

}  // namespace

Diff make_diff(const Course& course, const DiffParameters& parameters, std::uint64_t seed,
               ThingId first_id) {
  DiffMaker maker(course, seed, first_id);
  maker.change(parameters);
  // Occluders need more room than other things.
  maker.add_occluders(parameters.occluders);
  maker.add(parameters.added_share);
  return maker.take();
}

Diff make_clear_cut(const Course& course, const ClearCutParameters& parameters, std::uint64_t seed,
                    ThingId first_id) {
  DiffMaker maker(course, seed, first_id);
  const auto path = maker.path_m();
  const Eigen::Vector2d middle_of_all = 0.5 * (course.scene.low_m + course.scene.high_m).head<2>();
  std::uniform_int_distribution<std::size_t> draw(0, path.size() - 1);
  const Eigen::Vector2d start = path[draw(maker.random())].head<2>();
  const Eigen::Vector2d outwards = (start - middle_of_all).normalized();
  const Eigen::Vector2d middle = start + parameters.from_path_m * outwards;

  std::vector<NearTree> trees = trees_by_distance(course.scene, middle);
  const auto felled = static_cast<std::size_t>(std::max(0, parameters.felled));
  if (trees.size() < felled + static_cast<std::size_t>(std::max(0, parameters.hidden)))
    throw std::runtime_error("the forest has too few trees for this clear-cut");
  std::sort(trees.begin(), trees.begin() + static_cast<std::ptrdiff_t>(felled),
            [](const NearTree& a, const NearTree& b) { return a.tree->id < b.tree->id; });
  for (std::size_t i = 0; i < felled; ++i) maker.remove(*trees[i].tree);

  if (parameters.hidden > 0) {
    const std::span<const NearTree> standing = std::span(trees).subspan(felled);
    maker.add_occluder(best_lorry(course.scene, maker, standing, parameters.hidden));
  }
  return maker.take();
}

Scene changed(const Scene& scene, const Diff& diff) {
  Scene copy = scene;
  std::erase_if(copy.things, [&](const Thing& thing) {
    return std::binary_search(diff.removed.begin(), diff.removed.end(), thing.id);
  });
  for (const Move& move : diff.moved) {
    for (Thing& thing : copy.things) {
      if (thing.id == move.thing) thing = moved(std::move(thing), move.by_m);
    }
  }
  copy.things.insert(copy.things.end(), diff.added.begin(), diff.added.end());
  copy.things.insert(copy.things.end(), diff.occluders.begin(), diff.occluders.end());
  std::sort(copy.things.begin(), copy.things.end(),
            [](const Thing& a, const Thing& b) { return a.id < b.id; });
  copy.next_id = std::max(copy.next_id, diff.next_id);
  return copy;
}

std::string_view to_string(ThingState state) {
  return kStateNames[static_cast<std::size_t>(state)];
}

std::vector<TrueThing> compare(const Scene& before, const Scene& after) {
  std::vector<TrueThing> things;
  for (const Thing& thing : before.things) {
    const Thing* now = after.find(thing.id);
    TrueThing truth{thing.id, thing.kind, ThingState::kGone, Eigen::Vector3d::Zero(),
                    thing.extent.centre_m};
    if (now != nullptr) {
      truth.centre_m = now->extent.centre_m;
      truth.by_m = now->extent.centre_m - thing.extent.centre_m;
      truth.state = truth.by_m.isZero(0.0) ? ThingState::kPresent : ThingState::kMoved;
    }
    things.push_back(truth);
  }

  for (const Thing& thing : after.things) {
    if (before.find(thing.id) != nullptr) continue;
    things.push_back(
        {thing.id, thing.kind, ThingState::kNew, Eigen::Vector3d::Zero(), thing.extent.centre_m});
  }
  std::sort(things.begin(), things.end(),
            [](const TrueThing& a, const TrueThing& b) { return a.id < b.id; });
  return things;
}

}  // namespace understory::sim::changes
