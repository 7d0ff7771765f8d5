#include "common/hierarchy/descriptor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace understory::hierarchy {
namespace {

/// Gauss-Legendre points per panel. Eight lanes are two SSE registers; the loops over them below
/// are written for the compiler to vectorise.
constexpr std::size_t kLanes = 8;
using Lanes = std::array<float, kLanes>;

constexpr std::array<double, 4> kNodes{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                       0.9602898564975363};
constexpr std::array<double, 4> kWeights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                         0.1012285362903763};
/// Longest panel: in periods of the highest bin, and as part of the perimeter for the short series
/// of the rotation below to converge. The descriptor of a polygon is then within 0.005 of the exact
/// integral in 99 of 100 cases, within 0.3 where an edge passes so close to the centroid that the
/// distance has a kink; the invariances hold in all cases.
constexpr double kMaxPanelPeriods = 2.0;
constexpr double kMaxPanelPart = 0.25;

constexpr Lanes nodes() {
  Lanes result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = static_cast<float>(-kNodes[i]);
    result[4 + i] = static_cast<float>(kNodes[i]);
  }
  return result;
}

constexpr Lanes weights() {
  Lanes result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] = static_cast<float>(0.5 * kWeights[i]);
    result[4 + i] = static_cast<float>(0.5 * kWeights[i]);
  }
  return result;
}

constexpr Lanes kNode = nodes();
constexpr Lanes kWeight = weights();

/// Running Fourier integrals of a function along the perimeter, one partial sum per lane.
class Spectrum {
 public:
  explicit Spectrum(int bins) : bins_(bins) {}

  /// Adds a part of an edge. `middle` is relative to the centroid, `half` is the vector from there
  /// to the part's end [m]; phases are 2 pi times the fraction of the perimeter.
  void add(const Eigen::Vector2d& middle, const Eigen::Vector2d& half, double middle_phase,
           double half_phase) {
    const auto cosine = static_cast<float>(std::cos(middle_phase));
    const auto sine = static_cast<float>(std::sin(middle_phase));
    const auto scale = static_cast<float>(half_phase / std::numbers::pi);
    const auto mx = static_cast<float>(middle.x());
    const auto my = static_cast<float>(middle.y());
    const auto hx = static_cast<float>(half.x());
    const auto hy = static_cast<float>(half.y());

    const auto swing = static_cast<float>(half_phase);
    Lanes step_re;
    Lanes step_im;
    Lanes re;
    Lanes im{};

    for (std::size_t j = 0; j < kLanes; ++j) {
      const float x = mx + kNode[j] * hx;
      const float y = my + kNode[j] * hy;
      re[j] = kWeight[j] * scale * std::sqrt(x * x + y * y);

      // Short series instead of a sine and cosine per point: |angle| < pi / 4.
      const float angle = kNode[j] * swing;
      const float sq = angle * angle;
      const float c =
          1.0F - sq * (1.0F / 2) * (1.0F - sq * (1.0F / 12) * (1.0F - sq * (1.0F / 30)));
      const float s =
          angle * (1.0F - sq * (1.0F / 6) * (1.0F - sq * (1.0F / 20) * (1.0F - sq * (1.0F / 42))));
      step_re[j] = cosine * c - sine * s;
      step_im[j] = sine * c + cosine * s;
    }

    for (int k = 0; k < bins_; ++k) {
      Lanes& sum_re = re_[k];
      Lanes& sum_im = im_[k];
      for (std::size_t j = 0; j < kLanes; ++j) {
        sum_re[j] += re[j];
        sum_im[j] += im[j];
        const float turned = re[j] * step_re[j] - im[j] * step_im[j];
        im[j] = re[j] * step_im[j] + im[j] * step_re[j];
        re[j] = turned;
      }
    }
  }

  float magnitude(int bin) const {
    float re = 0.0F;
    float im = 0.0F;
    for (std::size_t j = 0; j < kLanes; ++j) {
      re += re_[bin][j];
      im += im_[bin][j];
    }
    return std::sqrt(re * re + im * im);
  }

 private:
  int bins_;
  std::array<Lanes, kMaxDescriptorBins> re_{};
  std::array<Lanes, kMaxDescriptorBins> im_{};
};

}  // namespace

int sample_count(double descriptor_step) {
  const auto samples = static_cast<int>(std::lround(1.0 / descriptor_step));
  if (samples < 4 || samples > 2 * static_cast<int>(kMaxDescriptorBins - 1)) {
    throw std::invalid_argument("descriptor_step must be from 1/30 to 1/4");
  }
  return samples;
}

Descriptor describe(std::span<const Eigen::Vector2d> boundary, int samples) {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  double perimeter = 0.0;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    centroid += boundary[i];
    perimeter += (boundary[(i + 1) % boundary.size()] - boundary[i]).norm();
  }
  centroid /= static_cast<double>(boundary.size());

  const int bins = samples / 2 + 1;
  Spectrum spectrum(bins);
  const double max_panel = std::min(kMaxPanelPeriods / (bins - 1), kMaxPanelPart);
  double phase = 0.0;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    const Eigen::Vector2d start = boundary[i] - centroid;
    const Eigen::Vector2d edge = boundary[(i + 1) % boundary.size()] - boundary[i];
    const double part = edge.norm() / perimeter;
    const int panels = std::max(1, static_cast<int>(std::ceil(part / max_panel)));
    const double half_phase = std::numbers::pi * part / panels;
    for (int p = 0; p < panels; ++p) {
      phase += half_phase;
      spectrum.add(start + edge * ((p + 0.5) / panels), edge * (0.5 / panels), phase, half_phase);
      phase += half_phase;
    }
  }

  Descriptor descriptor{};
  for (int k = 0; k < bins; ++k) {
    const double weight = (k == 0 ? 1.0 : std::numbers::sqrt2) * samples;
    descriptor[k] = static_cast<float>(weight) * spectrum.magnitude(k);
  }
  return descriptor;
}

float distance(const Descriptor& a, const Descriptor& b) {
  float sum = 0.0F;
  for (std::size_t k = 0; k < kMaxDescriptorBins; ++k) {
    sum += (a[k] - b[k]) * (a[k] - b[k]);
  }
  return std::sqrt(sum);
}

}  // namespace understory::hierarchy
