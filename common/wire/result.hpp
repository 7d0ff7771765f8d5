// Results of functions whose input may be wrong.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace understory::wire {

/// The reason of a refusal or a fault. HEALTH and LOG show its name (`to_string`).
enum class Reason : std::uint8_t {
  kTooShort,            ///< Shorter than its type.
  kTooLong,             ///< Bytes are left over.
  kWrongType,           ///< The fingerprint belongs to another type or version.
  kBadCount,            ///< A count is negative or exceeds the remaining bytes.
  kBadString,           ///< A length below one, no terminator, or a zero inside.
  kNotFinite,           ///< NaN or infinite.
  kOutOfRange,          ///< A value impossible for its quantity.
  kNotSymmetric,        ///< A covariance that is not symmetric.
  kNotPositive,         ///< A covariance that is not positive semidefinite.
  kInconsistent,        ///< Fields that contradict each other.
  kDuplicate,           ///< Received before.
  kLate,                ///< Received after a later one.
  kClockJump,           ///< A stamp far from the others.
  kTooLarge,            ///< More than the configuration allows in one message.
  kQueueFull,           ///< Dropped: more messages arrived than could be handled.
  kNotSent,             ///< The bus refused it.
  kStageFailed,         ///< The stage threw.
  kSnapshotDamaged,     ///< The saved state cannot be read.
  kJournalDamaged,      ///< The journal is cut or damaged.
  kStateNotKept,        ///< The state directory cannot be written.
  kSensorSilent,        ///< No message from a configured sensor.
  kSensorFrozen,        ///< A sensor repeats the same reading.
  kSaturated,           ///< At the end of the sensor's range.
  kNoPointTimes,        ///< A sweep whose points have no times: not de-skewed.
  kPartsMissing,        ///< A sweep with lost parts.
  kNoMotion,            ///< A sweep at a time without known motion: not de-skewed.
  kRestarted,           ///< A sender continued after a pause, or restarted.
  kNotCalibrated,       ///< The vehicle moved before the standstill was long enough.
  kReceiveBufferSmall,  ///< The kernel grants a smaller socket buffer than requested.
  kLost,                ///< The stage has no position of the vehicle or its landmarks.
  kRolledBack,          ///< Updates contradict the map and are undone.
  kWithheld,            ///< Results of insufficient quality are not published.
  kDiverged,            ///< Errors are far larger than stated.
  kInputRefused,        ///< Much of the input is refused.
  kMiscalibrated,       ///< Sensors contradict each other: a mounting or a scale differs from the
                        ///< configuration.
  kNewMap,              ///< A lost mapper began another map with its own frame.
  kNoiseMisstated,      ///< The input contradicts its stated noise.
  kNotStored,           ///< The store has not confirmed a submap that was handed over.
  kDiskFull,            ///< There is no space for the written file.
  kFileReadOnly,        ///< The file, or its folder, cannot be written.
  kFileDamaged,         ///< The file's content differs from the written content.
  kFileForeign,         ///< The file is of another kind.
  kFileInUse,           ///< Another process has the file open.
  kFileUnusable,        ///< The file cannot be opened or read, or has another version.
  kClientRefused,       ///< Too many web clients, or too many of their commands.
};

/// Name of the reason, lower_snake.
std::string_view to_string(Reason reason);

/// A refusal: the reason, and a text for people with the place.
struct Refusal {
  Reason reason = Reason::kInconsistent;
  std::string detail;
};

/// A value, or the reason why there is none. Access to the missing part throws
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
  /// The reason why there is no value.
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
