// Which sensor's packets are taken, and whether it is silent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace understory::lidar_driver {

/// Lets the packets of one sensor through: those of two on one port would be mixed into one sweep.
class SenderFilter {
 public:
  /// `address`: IPv4 of the sensor; empty = the first one that sends a good packet.
  void fix(const std::string& address);
  /// Whether the packet is of the sensor, or no sensor is known yet; else it is counted.
  bool admits(std::uint32_t sender);
  /// A good packet came from here: its sender is the sensor from now on.
  void set_sensor(std::uint32_t sender) { sensor_ = sender; }
  /// The sensor has been silent: unless the address is fixed, another one may take its place.
  void forget();

  /// Host's byte order; none before the first good packet.
  std::optional<std::uint32_t> sensor() const { return sensor_; }
  /// Packets of other senders so far.
  std::uint64_t refused() const { return refused_; }

 private:
  bool is_fixed_ = false;
  std::optional<std::uint32_t> sensor_;
  std::uint64_t refused_ = 0;
};

/// When the sensor last sent a good packet, and when to report on it: at once when it goes silent,
/// then once a second. Times are monotonic [us].
class SilenceWatch {
 public:
  /// What is to be done now.
  enum class Due : std::uint8_t {
    kNothing,
    kCheckClock,     ///< A second has passed, and packets come.
    kReportSilence,  ///< The sensor is silent.
  };

  /// `silence_s`: without a good packet for so long the sensor is silent.
  void set_silence_s(double silence_s) { silence_us_ = static_cast<std::int64_t>(1e6 * silence_s); }
  /// The first call starts the watch; later ones change nothing.
  void start(std::int64_t now_us);
  /// A good packet came. True where the sensor was reported silent before.
  bool hear(std::int64_t now_us);
  /// What is to be done at `now_us`.
  Due look(std::int64_t now_us);

  /// Whether the last good packet is too long ago.
  bool is_overdue(std::int64_t now_us) const { return now_us - good_us_ >= silence_us_; }
  /// Time since the last good packet [s].
  double silent_s(std::int64_t now_us) const {
    return 1e-6 * static_cast<double>(now_us - good_us_);
  }

 private:
  std::int64_t silence_us_ = 1'000'000;
  std::int64_t good_us_ = -1;  ///< When the last good data packet came.
  std::int64_t reported_us_ = -1;
  bool is_silent_ = false;
};

}  // namespace understory::lidar_driver
