// Checks a sensor's stamps.
#pragma once

#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// One sensor's clock. A jump (back, or ahead of all others), or a first stamp far from all others,
/// is accepted only after some consistent samples; from then on an offset is added to the stamps so
/// that time continues.
class SensorClock {
 public:
  /// Result for one stamp.
  enum class Verdict : std::uint8_t {
    kFine,         ///< Continues: use it.
    kLate,         ///< Not later than its predecessor: drop it.
    kJumped,       ///< The first after a jump: drop it.
    kQuarantined,  ///< A further one after a jump: drop it.
    kFollowed,     ///< The jump is accepted: use it, with the offset.
  };
  /// A result with the stamp to use.
  struct Answer {
    Verdict verdict = Verdict::kFine;
    model::Utime utime = 0;  ///< Of the sample, in the stage's time; for kFine and kFollowed.
  };

  /// `parameters`: size of a jump, and when it is accepted.
  explicit SensorClock(const FaultParameters& parameters) : parameters_(parameters) {}

  /// Checks a stamp. `others`: the newest stamp of the other sensors, if there is any, or the time
  /// at which all continue after a pause.
  Answer take(model::Utime raw, std::optional<model::Utime> others);
  /// The clock jumped together with another one: adds the same offset to the accepted stamp `raw`.
  /// False if time would not advance.
  bool share_offset(model::Utime raw, model::Utime offset_us, model::Utime before);
  /// Newest stamp in the stage's time; none before the first one.
  std::optional<model::Utime> last() const { return last_; }
  /// Offset added to the sensor's stamps since its clock jumped.
  model::Utime offset_us() const { return offset_; }
  /// Mean time between two samples [us]; 0 = unknown.
  double period_us() const { return period_us_; }
  /// A longer step than this [s] is a pause or a jump.
  double longest_step_s() const { return parameters_.clock_jump_s + 3e-6 * period_us_; }

  /// Members of a saved state; see common/state. The rest is configuration.
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
  double period_us_ = 0.0;  ///< Mean time between samples; 0 = unknown.
  model::Utime offset_ = 0;
  std::optional<model::Utime> first_candidate_;  ///< First stamp in quarantine.
  model::Utime candidate_ = 0;                   ///< Latest stamp in quarantine.
  int agreeing_ = 0;                             ///< Evenly spaced stamps in quarantine.
};

}  // namespace understory::lidar_imu_input
