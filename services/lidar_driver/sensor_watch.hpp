// Selects the sensor by its address, and detects its silence.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace understory::lidar_driver {

/// Accepts the packets of one sensor: packets of two sensors on one port would be mixed in one
/// sweep.
class SenderFilter {
 public:
  /// `address`: IPv4 of the sensor; empty = the first sender of a good packet.
  void fix(const std::string& address);
  /// Whether the packet is from the sensor, or no sensor is known yet; else it is counted.
  bool admits(std::uint32_t sender);
  /// Sets the sensor: the sender of a good packet.
  void set_sensor(std::uint32_t sender) { sensor_ = sender; }
  /// After silence of the sensor: unless the address is fixed, another sensor may replace it.
  void forget();

  /// Host's byte order; none before the first good packet.
  std::optional<std::uint32_t> sensor() const { return sensor_; }
  /// Number of packets from other senders.
  std::uint64_t refused() const { return refused_; }

 private:
  bool is_fixed_ = false;
  std::optional<std::uint32_t> sensor_;
  std::uint64_t refused_ = 0;
};

/// Time of the sensor's last good packet, and when to report: at once when it becomes silent, then
/// once a second. Times are monotonic [us].
class SilenceWatch {
 public:
  /// Action due now.
  enum class Due : std::uint8_t {
    kNothing,
    kCheckClock,     ///< A second has passed, and packets arrive.
    kReportSilence,  ///< The sensor is silent.
  };

  /// `silence_s`: time without a good packet after which the sensor is silent.
  void set_silence_s(double silence_s) { silence_us_ = static_cast<std::int64_t>(1e6 * silence_s); }
  /// The first call starts the watch; later calls do nothing.
  void start(std::int64_t now_us);
  /// Records a good packet. True if the sensor was reported silent before.
  bool hear(std::int64_t now_us);
  /// Action due at `now_us`.
  Due look(std::int64_t now_us);

  /// Whether the last good packet is too long ago.
  bool is_overdue(std::int64_t now_us) const { return now_us - good_us_ >= silence_us_; }
  /// Time since the last good packet [s].
  double silent_s(std::int64_t now_us) const {
    return 1e-6 * static_cast<double>(now_us - good_us_);
  }

 private:
  std::int64_t silence_us_ = 1'000'000;
  std::int64_t good_us_ = -1;  ///< Time of the last good data packet.
  std::int64_t reported_us_ = -1;
  bool is_silent_ = false;
};

}  // namespace understory::lidar_driver
