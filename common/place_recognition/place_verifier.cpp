#include "common/place_recognition/place_verifier.hpp"

#include <array>
#include <stdexcept>

#include "common/place_recognition/verifiers/correspondence_graph.hpp"
#include "common/place_recognition/verifiers/hough_association.hpp"
#include "common/place_recognition/verifiers/icp_verifier.hpp"
#include "common/place_recognition/verifiers/scan_context_verifier.hpp"
#include "common/place_recognition/verifiers/stem_verifier.hpp"

namespace understory::place_recognition {
namespace {

using VerifierPointer = std::unique_ptr<PlaceVerifier>;

template <verifiers::IcpMetric kMetric>
VerifierPointer icp(const VerifierParameters& parameters) {
  return std::make_unique<verifiers::IcpVerifier>(kMetric, parameters);
}

template <class Verifier>
VerifierPointer made(const VerifierParameters& parameters) {
  return std::make_unique<Verifier>(parameters);
}

struct VerifierKind {
  const char* name;
  bool wants_cloud;
  VerifierPointer (*make)(const VerifierParameters&);
};
constexpr std::array kVerifiers{
    VerifierKind{"correspondence_graph", false, made<verifiers::CorrespondenceGraphVerifier>},
    VerifierKind{"hough", false, made<verifiers::HoughVerifier>},
    VerifierKind{"icp_point_to_point", true, icp<verifiers::IcpMetric::kPointToPoint>},
    VerifierKind{"icp_point_to_plane", true, icp<verifiers::IcpMetric::kPointToPlane>},
    VerifierKind{"generalised_icp", true, icp<verifiers::IcpMetric::kGeneralised>},
    VerifierKind{"scan_context", true, made<verifiers::ScanContextVerifier>},
    VerifierKind{"stem_likelihood", false, made<verifiers::StemVerifier>}};

const VerifierKind& verifier_kind(std::string_view name) {
  std::string allowed;
  for (const VerifierKind& kind : kVerifiers) {
    if (kind.name == name) return kind;
    allowed += std::string(allowed.empty() ? "" : ", ") + kind.name;
  }
  throw std::invalid_argument("verifier \"" + std::string(name) + "\": not one of " + allowed);
}

}  // namespace

std::vector<std::string> verifier_names() {
  std::vector<std::string> names;
  names.reserve(kVerifiers.size());
  for (const VerifierKind& kind : kVerifiers) names.emplace_back(kind.name);
  return names;
}

std::unique_ptr<PlaceVerifier> make_verifier(std::string_view name,
                                             const VerifierParameters& parameters) {
  return verifier_kind(name).make(parameters);
}

bool verifier_wants_cloud(std::string_view name) { return verifier_kind(name).wants_cloud; }

}  // namespace understory::place_recognition
