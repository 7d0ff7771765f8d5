// Difference between a scene and a changed copy of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/changes/course.hpp"

namespace understory::sim::changes {

/// A thing that was moved.
struct Move {
  ThingId thing = kGroundThing;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();  ///< Frame `world`.
};

/// The difference between two copies of a scene (thesis on existence, *Dynamics Recording*).
struct Diff {
  std::vector<ThingId> removed;    ///< Ascending.
  std::vector<Move> moved;         ///< Ascending by thing.
  std::vector<Thing> added;        ///< With ids that are new.
  std::vector<Thing> occluders;    ///< Added to hide unchanged things.
  ThingId next_id = kGroundThing;  ///< First free id in the changed copy.
};

/// Amount of change.
struct DiffParameters {
  double share = 0.2;        ///< Of the changeable things: removed or moved, in [0, 1].
  double moved_share = 0.4;  ///< Of the changed movable things: moved.
  double move_m = 0.5;       ///< In the plan.
  double added_share = 1.0;  ///< New things per removed one.
  int occluders = 2;
  std::optional<ThingKind> only;  ///< The only kind that changes; none: all.
};

/// Draws a random diff. Exactly round(share * changeable things) things are removed or moved; a
/// thing without room at the given distance is removed instead. New things and occluders are added
/// as far as there is room. Ids of new things begin at `first_id`, or if that is 0 at
/// scene.next_id: several copies of one scene need different ones.
Diff make_diff(const Course& course, const DiffParameters& parameters, std::uint64_t seed,
               ThingId first_id = 0);

/// A felled patch of the forest, with a lorry beside it.
struct ClearCutParameters {
  int felled = 50;            ///< The trees nearest to the middle of the patch.
  int hidden = 20;            ///< Trees hidden by the lorry, of the remaining ones.
  double from_path_m = 12.0;  ///< Of the middle of the patch.
};
/// Fells neighbouring trees and parks the lorry between the path and other trees, where it hides as
/// many as possible, up to `hidden`. Throws std::runtime_error if there are too few trees or no
/// room for a lorry.
Diff make_clear_cut(const Course& course, const ClearCutParameters& parameters, std::uint64_t seed,
                    ThingId first_id = 0);

/// The changed copy. Things of the diff that do not exist are ignored.
Scene changed(const Scene& scene, const Diff& diff);

/// Change of a thing.
enum class ThingState : std::uint8_t { kPresent, kGone, kMoved, kNew };
/// "present", "gone", "moved", "new".
std::string_view to_string(ThingState state);

/// A thing of either copy.
struct TrueThing {
  ThingId id = kGroundThing;
  ThingKind kind = ThingKind::kEquipment;
  ThingState state = ThingState::kPresent;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();      ///< Its displacement.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< In the copy; if gone, the earlier one.
};
/// All things of both copies, in order of id.
std::vector<TrueThing> compare(const Scene& before, const Scene& after);

}  // namespace understory::sim::changes
