// Converts laser clouds to sweeps; finds the fields of time, ring and intensity of each driver.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/bag/cloud_fields.hpp"
#include "common/bag/messages.hpp"
#include "common/model/point_sweep.hpp"

namespace understory::bag {

/// Properties of a cloud that the user states.
struct CloudOptions {
  /// Unit of the field with the points' times [s]; none = derived from the field and the data.
  std::optional<double> time_unit_s;
  /// Range of the sensor [m]: points more than 1 % beyond it are left out.
  double max_range_m = 120.0;
};

/// Input: clouds; output: sweeps in frame `sensor`. Units and the order of rings are derived from
/// the first clouds and apply to all later ones.
///
/// Times: the field `t`, `time`, `timestamp`, `time_stamp`, `time_offset`, `time_offset_ns`,
/// `offset_time`, ...: integers are nanoseconds, floats seconds, unless the sweep would be too long
/// and another unit gives 2 ms to 1.5 s. Numbers far from zero are absolute times of some clock; if
/// it differs from the stamp's clock by more than 10 s, the first point is at the stamp. A constant
/// field has no times. Rings: `ring`, `line`, `channel`, `laser_id`, `ring_id`, or the row of an
/// organised cloud; renumbered so that 0 is the lowest; without these, find_rings() searches rings
/// in each cloud. Intensity: `reflectivity`, else `intensity`, `i`; 0 .. 255.
class CloudDecoder {
 public:
  /// Default options: everything is derived from the data.
  explicit CloudDecoder(const CloudOptions& options = {}) : options_(options) {}

  /// Points that are not finite or at the origin (no return) are left out. utime: the stamp, or the
  /// time of the first point if that is earlier. Throws io::DataError where fields and data do not
  /// match.
  model::PointSweep decode(const PointCloud& cloud);
  /// The same for Livox's own message.
  model::PointSweep decode(const LivoxCloud& cloud);
  /// Description of the fields found, for people: "times: t (uint32, 1e-09 s from the stamp);
  /// rings: ring ...".
  std::string description() const;

 private:
  /// Order of the sensor's ring numbers.
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
  std::optional<double> unit_s_;  ///< Unit of the points' times, when known.
  bool is_absolute_ = false;      ///< Times are absolute, not relative to the stamp.
  bool is_own_clock_ = false;     ///< The clock differs from the stamp's clock.
  bool is_too_coarse_ = false;    ///< The field's type cannot hold times of points.
  RingOrder ring_order_ = RingOrder::kUnknown;
  std::uint32_t rings_ = 0;                 ///< Number of beams, as far as known.
  std::vector<std::uint16_t> ring_table_;   ///< Ring by the sensor's number.
  std::optional<double> intensity_factor_;  ///< Factor to 0 .. 255.
  std::string time_text_ = "none";
  std::string ring_text_ = "none";
  std::uint64_t revolutions_ = 0;
};

}  // namespace understory::bag
