// Stems around the vehicle over the last metres of its path.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/place_recognition/level_stems.hpp"
#include "services/loop_closer/parameters.hpp"

namespace understory::loop_closer {

using place_recognition::LevelStem;

/// The last keyframe of a window.
struct WindowEnd {
  std::uint64_t sequence = 0;  ///< Of the keyframe.
  geometry::SE2 map_T_base;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.sequence, s.map_T_base);
  }
};

/// Effect of a keyframe on the window.
enum class WindowStep { kWentOn, kBegun };

/// Joins the detections of each stem in several keyframes. A single frame may contain three stems;
/// the last metres contain enough to identify a place. The mapper gives the association of the
/// detections and the relative poses of the keyframes.
class PlaceWindow {
 public:
  /// Without keyframes. `parameters` gives window_m, merge_m, min_stems and most_stems.
  explicit PlaceWindow(const PlaceParameters& parameters) : parameters_(parameters) {}

  /// Adds a localised keyframe. If its pose relative to the last one contradicts tracking (the
  /// mapper has corrected the map between them), a new window begins with it.
  WindowStep add(const model::Keyframe& keyframe, const model::MapUpdate& update);
  /// The next keyframe begins the window.
  void restart() { seen_.clear(); }

  /// Path length of the vehicle [m] since the first keyframe.
  double along_m() const { return along_m_; }
  /// The stems around the last keyframe's base, frame `vehicle_level` of that scan; the nearest
  /// `most_stems`. In a window of at least four keyframes with at least `min_stems` stems detected
  /// twice, only these. O(stems^2).
  std::vector<LevelStem> stems() const;

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.seen_, self.last_, self.along_m_);
  }

 private:
  /// A detected stem, frame `map` at the time of its keyframe.
  struct SeenStem {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double diameter_m = 0.0;
    model::LandmarkId landmark = 0;  ///< 0: none.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.position_m, s.diameter_m, s.landmark);
    }
  };
  /// The detections of one keyframe.
  struct Seen {
    double along_m = 0.0;
    std::vector<SeenStem> stems;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.along_m, s.stems);
    }
  };
  bool was_corrected(const model::Keyframe& keyframe, const geometry::SE2& last_T_base) const;

  PlaceParameters parameters_;
  std::deque<Seen> seen_;  ///< In order of time.
  std::optional<WindowEnd> last_;
  double along_m_ = 0.0;
};

}  // namespace understory::loop_closer
