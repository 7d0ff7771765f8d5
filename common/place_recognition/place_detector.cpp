#include "common/place_recognition/place_detector.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "common/place_recognition/detectors/constellation_detector.hpp"
#include "common/place_recognition/detectors/glare.hpp"
#include "common/place_recognition/detectors/glarot_3d.hpp"
#include "common/place_recognition/detectors/hierarchy_detector.hpp"
#include "common/place_recognition/detectors/linear_detector.hpp"
#include "common/place_recognition/detectors/range_histogram.hpp"
#include "common/place_recognition/detectors/scan_context.hpp"
#include "common/place_recognition/detectors/stem_detector.hpp"

namespace understory::place_recognition {
namespace {

using DetectorPointer = std::unique_ptr<PlaceDetector>;

DetectorPointer range_histogram(const DetectorParameters& parameters) {
  using Detector = detectors::LinearDetector<detectors::RangeHistogram>;
  return std::make_unique<Detector>(detectors::RangeHistogram(parameters.range_histogram));
}

template <detectors::BearingInvariance kInvariance>
DetectorPointer glare(const DetectorParameters& parameters) {
  using Detector = detectors::LinearDetector<detectors::GlareSignature>;
  return std::make_unique<Detector>(
      detectors::GlareSignature(parameters.glare, kInvariance, parameters.place_sigma_m));
}

DetectorPointer glarot_3d(const DetectorParameters& parameters) {
  using Detector = detectors::LinearDetector<detectors::Glarot3dSignature>;
  return std::make_unique<Detector>(
      detectors::Glarot3dSignature(parameters.glarot_3d, parameters.place_sigma_m));
}

DetectorPointer scan_context(const DetectorParameters& parameters) {
  return std::make_unique<detectors::ScanContextDetector>(parameters.scan_context,
                                                          parameters.place_sigma_m);
}

DetectorPointer geometric_hierarchy(const DetectorParameters& parameters) {
  return std::make_unique<detectors::HierarchyDetector>(parameters.hierarchy,
                                                        parameters.stems.noise.sigma_m);
}

DetectorPointer constellation_search(const DetectorParameters& parameters) {
  return std::make_unique<detectors::ConstellationDetector>(parameters.constellation);
}

DetectorPointer stem_recogniser(const DetectorParameters& parameters) {
  return std::make_unique<detectors::StemDetector>(parameters.stems);
}

struct DetectorKind {
  const char* name;
  bool wants_cloud;
  bool gives_evidence;
  DetectorPointer (*make)(const DetectorParameters&);
};
constexpr std::array kDetectors{
    DetectorKind{"range_histogram", true, false, range_histogram},
    DetectorKind{"glare", false, false, glare<detectors::BearingInvariance::kNone>},
    DetectorKind{"glarot", false, false, glare<detectors::BearingInvariance::kShifted>},
    DetectorKind{"glarot_3d", false, false, glarot_3d},
    DetectorKind{"scan_context", true, false, scan_context},
    DetectorKind{"geometric_hierarchy", false, false, geometric_hierarchy},
    DetectorKind{"constellation", false, false, constellation_search},
    DetectorKind{"stems", false, true, stem_recogniser}};

const DetectorKind& detector_kind(std::string_view name) {
  std::string allowed;
  for (const DetectorKind& kind : kDetectors) {
    if (kind.name == name) return kind;
    allowed += std::string(allowed.empty() ? "" : ", ") + kind.name;
  }
  throw std::invalid_argument("detector \"" + std::string(name) + "\": not one of " + allowed);
}

}  // namespace

std::vector<std::string> detector_names() {
  std::vector<std::string> names;
  names.reserve(kDetectors.size());
  for (const DetectorKind& kind : kDetectors) names.emplace_back(kind.name);
  return names;
}

std::unique_ptr<PlaceDetector> make_detector(std::string_view name,
                                             const DetectorParameters& parameters) {
  return detector_kind(name).make(parameters);
}

bool wants_cloud(std::string_view detector) { return detector_kind(detector).wants_cloud; }

bool gives_evidence(std::string_view detector) { return detector_kind(detector).gives_evidence; }

}  // namespace understory::place_recognition
