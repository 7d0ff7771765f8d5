// What comes back where data may be wrong.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace understory::wire {

/// Why a message or a value was not taken. The names (`to_string`) are what HEALTH and LOG show.
enum class Reason : std::uint8_t {
  kTooShort,            ///< Ends before its type does.
  kTooLong,             ///< Bytes are left over.
  kWrongType,           ///< The fingerprint is another type's (or another version's).
  kBadCount,            ///< A count is negative or promises more than there is.
  kBadString,           ///< A length below one, no terminator, or a zero inside.
  kNotFinite,           ///< NaN or infinite.
  kOutOfRange,          ///< A value that its quantity cannot have.
  kNotSymmetric,        ///< Of a covariance.
  kNotPositive,         ///< A covariance that is not positive semidefinite.
  kInconsistent,        ///< Fields that contradict each other.
  kDuplicate,           ///< Came before.
  kLate,                ///< Came after a later one.
  kClockJump,           ///< A stamp far from the others'.
  kTooLarge,            ///< More than the configuration allows in one message.
  kQueueFull,           ///< Shed: more came than could be handled.
  kNotSent,             ///< The bus refused it.
  kStageFailed,         ///< The stage threw.
  kSnapshotDamaged,     ///< The saved state cannot be read.
  kJournalDamaged,      ///< The journal is cut or damaged.
  kStateNotKept,        ///< The state directory cannot be written.
  kSensorSilent,        ///< Nothing came from a sensor that is configured.
  kSensorFrozen,        ///< A sensor repeats the same reading.
  kSaturated,           ///< At the end of the sensor's range.
  kNoPointTimes,        ///< A sweep whose points have no times: not de-skewed.
  kPartsMissing,        ///< A sweep of which parts were lost.
  kNoMotion,            ///< A sweep for whose time no motion is known: not de-skewed.
  kRestarted,           ///< Something went on after a pause, or began anew.
  kNotCalibrated,       ///< The vehicle moved before the standstill was long enough.
  kReceiveBufferSmall,  ///< The kernel grants less socket buffer than asked for.
  kLost,                ///< The stage does not know where the vehicle or its landmarks are.
  kRolledBack,          ///< Updates contradict the map and are taken back.
  kWithheld,            ///< Results that are not good enough are not given out.
  kDiverged,            ///< Errors are far larger than stated.
  kInputRefused,        ///< Much of what comes in is refused.
  kMiscalibrated,   ///< Sensors contradict each other: a mounting or a scale is not as configured.
  kNewMap,          ///< A lost mapper began another map, in a frame of its own.
  kNoiseMisstated,  ///< What comes in contradicts the noise that it states.
  kNotStored,       ///< What was handed over has not been confirmed by who keeps it.
  kDiskFull,        ///< There is no room for the file that is written.
  kFileReadOnly,    ///< The file, or its folder, cannot be written.
  kFileDamaged,     ///< The file's content is not what was written.
  kFileForeign,     ///< The file is something else.
  kFileInUse,       ///< Another process has the file open.
  kFileUnusable,    ///< The file cannot be opened or read, or is of another version.
  kClientRefused,   ///< More web clients, or commands of theirs, than are let in.
};

/// Name of the reason, lower_snake.
std::string_view to_string(Reason reason);

/// A refusal: the reason code, and a text for a person that names the place.
struct Refusal {
  Reason reason = Reason::kInconsistent;
  std::string detail;
};

/// A value, or why there is none. Asking for the part that is not there throws
/// std::bad_variant_access.
template <class T>
class [[nodiscard]] Result {
 public:
  /// A success.
  Result(T value) : content_(std::move(value)) {}  // NOLINT(google-explicit-constructor)
  /// A failure.
  Result(Refusal refusal) : content_(std::move(refusal)) {}  // NOLINT(google-explicit-constructor)

  /// True for a value.
  explicit operator bool() const { return content_.index() == 0; }
  /// The value.
  T& value() { return std::get<0>(content_); }
  /// The value.
  const T& value() const { return std::get<0>(content_); }
  /// Why there is no value.
  const Refusal& refusal() const { return std::get<1>(content_); }
  /// The value's members.
  T* operator->() { return &value(); }
  /// The value's members.
  const T* operator->() const { return &value(); }
  /// The value.
  T& operator*() { return value(); }
  /// The value.
  const T& operator*() const { return value(); }

 private:
  std::variant<T, Refusal> content_;
};

}  // namespace understory::wire
