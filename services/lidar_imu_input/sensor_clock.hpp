// Whether a sensor's stamps are to be believed.
#pragma once

#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// One sensor's clock. A jump (back, or ahead of all others), or a first stamp far from all others,
/// is not believed until some samples agree with each other; from then on their stamps are moved so
/// that time goes on.
class SensorClock {
 public:
  /// What was found about one stamp.
  enum class Verdict : std::uint8_t {
    kFine,         ///< Goes on: to be used.
    kLate,         ///< Not after its predecessor: to be dropped.
    kJumped,       ///< The first one that is not believed: to be dropped.
    kQuarantined,  ///< One more of those: to be dropped.
    kFollowed,     ///< The jump is believed: to be used, moved onto the stage's time.
  };
  /// A verdict with the stamp to use.
  struct Answer {
    Verdict verdict = Verdict::kFine;
    model::Utime utime = 0;  ///< Of the sample, on the stage's time; for kFine and kFollowed.
  };

  /// What counts as a jump, and when it is followed.
  explicit SensorClock(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Judges a stamp. `others`: the newest stamp of the other sensors, if there is any, or the time
  /// at which all go on after a pause.
  Answer take(model::Utime raw, std::optional<model::Utime> others);
  /// The clock was found to have jumped with another one: the stamp `raw` that was followed is
  /// moved by as much as that. False where time would not go on.
  bool share_offset(model::Utime raw, model::Utime offset_us, model::Utime before);
  /// Newest stamp on the stage's time; none before the first one.
  std::optional<model::Utime> last() const { return last_; }
  /// What is added to the sensor's stamps since its clock jumped.
  model::Utime offset_us() const { return offset_; }
  /// Mean time between two samples [us]; 0 = not known yet.
  double period_us() const { return period_us_; }
  /// A longer step than this [s] is a pause or a jump.
  double longest_step_s() const { return parameters_.clock_jump_s + 3e-6 * period_us_; }

  /// For saving and loading: what changes while it runs.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.last_, self.period_us_, self.offset_, self.first_candidate_, self.candidate_,
      self.agreeing_);
  }

 private:
  Answer quarantine(model::Utime raw, std::optional<model::Utime> others);
  bool is_plausible(model::Utime utime, std::optional<model::Utime> others) const;

  FaultParameters parameters_;
  std::optional<model::Utime> last_;
  double period_us_ = 0.0;  ///< Mean time between samples; 0 = not known yet.
  model::Utime offset_ = 0;
  std::optional<model::Utime> first_candidate_;  ///< First stamp in quarantine.
  model::Utime candidate_ = 0;                   ///< Latest stamp in quarantine.
  int agreeing_ = 0;                             ///< Stamps in quarantine that go on evenly.
};

}  // namespace understory::lidar_imu_input
