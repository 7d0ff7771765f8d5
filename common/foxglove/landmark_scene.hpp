// The map's landmarks as a scene of entities, each of up to 16 landmarks.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "common/foxglove/scene.hpp"
#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"

namespace understory::foxglove {

/// Follows the map as `model::HeldMap` does, and tells which entities differ from what was told
/// before. Landmarks that were handed over are in the frame of their submap, so a correction moves
/// one transform and no entity. Positions and radii are those drawn: whole millimetres.
///
/// Memory: about 150 bytes a landmark, of at most `most_landmarks`; further ones are left out and
/// counted. Each take() costs O(what is in the message * log(map)), MAP O(map), an update
/// O(changed).
class LandmarkScene {
 public:
  /// With a bound for the landmarks that are kept.
  explicit LandmarkScene(std::size_t most_landmarks) : most_(most_landmarks) {}

  /// The whole map; one that is cut to bounds is passed over.
  void take(const model::WholeMap& map);
  /// What changed; an older one is passed over.
  void take(const model::MapDelta& delta);
  /// The update that starts a map ends the one before.
  void take(const model::MapUpdate& update);
  /// What the mapper handed over.
  void take(const model::Submap& submap);
  /// Probabilities of landmarks that are there; others are passed over.
  void take(const model::Existence& existence);

  /// Whether update() has something to tell.
  bool has_changed() const { return was_cleared_ || !changed_.empty(); }
  /// A SceneUpdate with the entities that changed since the last call.
  std::string update(model::Utime utime);
  /// The same as if it had been written, and thrown away.
  void skip_update();
  /// A SceneUpdate that deletes everything and has all entities.
  std::string whole(model::Utime utime) const;
  /// Landmarks in the scene.
  std::size_t size() const { return submap_of_.size(); }
  /// Landmarks that were left out since the map started.
  std::uint64_t left_out() const { return left_out_; }

 private:
  /// One landmark, rounded as it is drawn.
  struct Shown {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double radius_m = 0.0;
    model::LandmarkKind kind = model::LandmarkKind::kTrunk;
    double probability = std::numeric_limits<double>::quiet_NaN();
    bool is_in_use = true;
  };
  /// An entity: landmarks of one submap (0 = held by the mapper) with neighbouring ids.
  struct BlockId {
    std::uint64_t submap = 0;
    std::uint64_t number = 0;
    bool operator<(const BlockId& other) const {
      return std::tie(submap, number) < std::tie(other.submap, other.number);
    }
  };
  using Block = std::map<model::LandmarkId, Shown>;

  static BlockId block_of(model::LandmarkId id, std::uint64_t submap);
  static std::string name_of(const BlockId& id);
  void clear();
  void put(const model::MapLandmark& landmark, std::uint64_t submap);
  void drop(model::LandmarkId id);
  void append_entity(JsonText& out, model::Utime utime, const BlockId& id,
                     const Block& block) const;

  std::size_t most_;
  std::map<BlockId, Block> blocks_;  ///< None of them empty.
  std::unordered_map<model::LandmarkId, std::uint64_t> submap_of_;
  std::set<BlockId> changed_;  ///< Also those that are gone.
  bool was_cleared_ = true;    ///< Since the last update: what a client had is worth nothing.
  std::uint64_t version_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace understory::foxglove
