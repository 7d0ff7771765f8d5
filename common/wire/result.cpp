#include "common/wire/result.hpp"

namespace understory::wire {

std::string_view to_string(Reason reason) {
  switch (reason) {
    case Reason::kTooShort:
      return "too_short";
    case Reason::kTooLong:
      return "too_long";
    case Reason::kWrongType:
      return "wrong_type";
    case Reason::kBadCount:
      return "bad_count";
    case Reason::kBadString:
      return "bad_string";
    case Reason::kNotFinite:
      return "not_finite";
    case Reason::kOutOfRange:
      return "out_of_range";

    case Reason::kNotSymmetric:
      return "not_symmetric";
    case Reason::kNotPositive:
      return "not_positive";
    case Reason::kInconsistent:
      return "inconsistent";
    case Reason::kDuplicate:
      return "duplicate";
    case Reason::kLate:
      return "late";
    case Reason::kClockJump:
      return "clock_jump";
    case Reason::kTooLarge:
      return "too_large";
    case Reason::kQueueFull:
      return "queue_full";

    case Reason::kNotSent:
      return "not_sent";
    case Reason::kStageFailed:
      return "stage_failed";
    case Reason::kSnapshotDamaged:
      return "snapshot_damaged";
    case Reason::kJournalDamaged:
      return "journal_damaged";
    case Reason::kStateNotKept:
      return "state_not_kept";
    case Reason::kSensorSilent:
      return "sensor_silent";
    case Reason::kSensorFrozen:
      return "sensor_frozen";

    case Reason::kSaturated:
      return "saturated";
    case Reason::kNoPointTimes:
      return "no_point_times";
    case Reason::kPartsMissing:
      return "parts_missing";
    case Reason::kNoMotion:
      return "no_motion";
    case Reason::kRestarted:
      return "restarted";
    case Reason::kNotCalibrated:
      return "not_calibrated";
    case Reason::kReceiveBufferSmall:
      return "receive_buffer_small";

    case Reason::kLost:
      return "lost";
    case Reason::kRolledBack:
      return "rolled_back";
    case Reason::kWithheld:
      return "withheld";
    case Reason::kDiverged:
      return "diverged";
    case Reason::kInputRefused:
      return "input_refused";
    case Reason::kMiscalibrated:
      return "miscalibrated";
    case Reason::kNewMap:
      return "new_map";
    case Reason::kNoiseMisstated:
      return "noise_misstated";
    case Reason::kNotStored:
      return "not_stored";
    case Reason::kDiskFull:
      return "disk_full";
    case Reason::kFileReadOnly:
      return "file_read_only";
    case Reason::kFileDamaged:
      return "file_damaged";
    case Reason::kFileForeign:
      return "file_foreign";
    case Reason::kFileInUse:
      return "file_in_use";
    case Reason::kFileUnusable:
      return "file_unusable";
    case Reason::kClientRefused:
      return "client_refused";
  }

  return "unknown";
}

}  // namespace understory::wire
