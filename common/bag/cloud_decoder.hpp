// Clouds of lasers as sweeps: where each driver keeps the time, the ring and the intensity.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/bag/cloud_fields.hpp"
#include "common/bag/messages.hpp"
#include "common/model/point_sweep.hpp"

namespace understory::bag {

/// What a person states about a cloud.
struct CloudOptions {
  /// Of the field with the points' times [s]; none = found from the field and the data.
  std::optional<double> time_unit_s;
  /// Beyond it nothing is seen [m]: points more than 1 % beyond are left out.
  double max_range_m = 120.0;
};

/// Clouds in, sweeps in frame `sensor` out. What the first clouds show of units and of the order of
/// rings holds for all that follow.
///
/// Times: the field `t`, `time`, `timestamp`, `time_stamp`, `time_offset`, `time_offset_ns`,
/// `offset_time`, ...: integers are nanoseconds, floats seconds, unless a sweep cannot last so long
/// and another unit gives it 2 ms to 1.5 s. Numbers that are not near zero are absolute, by
/// whatever clock; where that is not the stamp's (more than 10 s apart), the first point is at the
/// stamp. A field that is always the same holds no times. Rings: `ring`, `line`, `channel`,
/// `laser_id`, `ring_id`, or the row of an organised cloud; renumbered so that 0 is the lowest;
/// where there are none, find_rings() looks for them in each cloud.
/// Intensity: `reflectivity`, else `intensity`, `i`; 0 .. 255.
class CloudDecoder {
 public:
  /// Nothing stated: everything from the data.
  explicit CloudDecoder(const CloudOptions& options = {}) : options_(options) {}

  /// Points that are not finite or at the origin (no return) are left out. utime: the stamp, or the
  /// first point where that is earlier. Throws io::DataError where fields and data do not fit.
  model::PointSweep decode(const PointCloud& cloud);
  /// The same of Livox's own message.
  model::PointSweep decode(const LivoxCloud& cloud);
  /// What was found, for people: "times: t (uint32, 1e-09 s from the stamp); rings: ring ...".
  std::string description() const;

 private:
  /// How the rings of the sensor are counted.
  enum class RingOrder : std::uint8_t { kUnknown, kUpwards, kDownwards, kTable };
  enum class RingPlace : std::uint8_t;
  struct RawPoint;
  struct Layout;

  Layout layout_of(const PointCloud& cloud) const;
  void decide_time(const std::vector<RawPoint>& points, std::int64_t stamp_ns, FieldType type);
  bool take_found_rings(std::vector<RawPoint>& points);
  void decide_rings(const std::vector<RawPoint>& points);
  void decide_intensity(const std::vector<RawPoint>& points, bool is_integer);
  std::uint16_t ring_of(std::uint32_t ring) const;
  std::string time_text(const FieldReader& field) const;
  std::vector<std::int64_t> times_from_stamp(const std::vector<RawPoint>& points,
                                             std::int64_t stamp_ns) const;
  void set_times(const std::vector<RawPoint>& points, const Header& header,
                 model::PointSweep& sweep) const;
  model::PointSweep sweep_of(std::vector<RawPoint> points, const Header& header, bool has_times,
                             bool has_rings);

  CloudOptions options_;
  std::optional<double> unit_s_;  ///< Of the points' times, once decided.
  bool is_absolute_ = false;      ///< Times are those of a clock, not from the stamp.
  bool is_own_clock_ = false;     ///< Which is not the stamp's.
  bool is_too_coarse_ = false;    ///< The field's type cannot hold times of points.
  RingOrder ring_order_ = RingOrder::kUnknown;
  std::uint32_t rings_ = 0;                 ///< Number of beams, as far as known.
  std::vector<std::uint16_t> ring_table_;   ///< By the sensor's number.
  std::optional<double> intensity_factor_;  ///< To 0 .. 255.
  std::string time_text_ = "none";
  std::string ring_text_ = "none";
  std::uint64_t revolutions_ = 0;
};

}  // namespace understory::bag
