// ANSI/IES LM-63-2019, "Approved method: IES standard file format for the electronic transfer of
// photometric data", and its predecessors, which differ in what comes before TILT.

#include "rebounce/lights.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "rebounce/error.h"
#include "transfer/base/number_text.h"

namespace rebounce {
namespace {

constexpr std::size_t kMostAngles = 4096;
constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr float kAngleTolerance = 0.01F;  // degrees; files hold rounded numbers

class IesReader {
 public:
  IesReader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  std::shared_ptr<const IntensityProfile> read() {
    // From 1995 on the head names the year, and the ballast-lamp factor is 1 or no factor.
    const std::string_view head = rest_.substr(0, rest_.find("TILT="));
    const bool is_old = head.find("IESNA:LM-63-") == std::string_view::npos &&
                        head.find("IES:LM-63-") == std::string_view::npos;
    skip_to_tilt();
    number("number of lamps");
    number("lumens per lamp");
    float scale = number("candela multiplier");
    const std::size_t vertical_count = count("number of vertical angles");
    const std::size_t horizontal_count = count("number of horizontal angles");
    if (number("photometric type") != 1) refuse("is not of photometric type C");
    for (const char* what : {"units", "width", "length", "height"}) number(what);
    scale *= number("ballast factor");
    const float ballast_lamp_factor = number("ballast-lamp factor");
    if (is_old) scale *= ballast_lamp_factor;
    number("input watts");
    if (!(scale >= 0)) refuse("has a negative multiplier");

    auto profile = std::make_shared<IntensityProfile>();
    profile->vertical = angles(vertical_count, "vertical angle");
    profile->horizontal = angles(horizontal_count, "horizontal angle");
    check_angles(*profile);
    for (std::size_t k = 0; k < vertical_count * horizontal_count; ++k) {
      const float candela = number("candela value");
      if (!(candela >= 0)) refuse("has a negative candela value");
      profile->candela.push_back(scale * candela);
      if (!std::isfinite(profile->candela.back())) refuse("has a candela value that is too large");
    }
    for (float& a : profile->vertical) a = std::min(a * kDegree, std::numbers::pi_v<float>);
    for (float& a : profile->horizontal) a *= kDegree;
    return profile;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(name_ + " " + what + "; give an IES file (LM-63) of type C photometry");
  }

  std::string_view line() {
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return line;
  }

  /// Skips to the line after TILT=, and past the lamp's tilt factors if the file has them. These
  /// say how the output falls when the luminaire is tilted; the profile does not use them.
  void skip_to_tilt() {
    while (!rest_.empty()) {
      const std::string_view text = line();
      if (!text.starts_with("TILT=")) continue;
      if (!text.starts_with("TILT=INCLUDE")) return;
      number("lamp-to-luminaire geometry");
      const std::size_t pairs = count("number of tilt angles");
      for (std::size_t k = 0; k < 2 * pairs; ++k) number("tilt factor");
      return;
    }
    refuse("has no line that begins with TILT=");
  }

  float number(const char* what) {
    const std::size_t begin = rest_.find_first_not_of(" \t\r\n,");
    rest_.remove_prefix(std::min(begin, rest_.size()));
    if (rest_.starts_with('+')) rest_.remove_prefix(1);
    float value = 0;
    const auto [end, error] = read_number(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc() || !std::isfinite(value)) {
      refuse(std::string("has no number where its ") + what + " must be");
    }
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return value;
  }

  std::size_t count(const char* what) {
    const float value = number(what);
    if (!(value >= 1 && value <= kMostAngles && value == std::floor(value))) {
      refuse(std::string("has a ") + what + " that is not from 1 to " +
             std::to_string(kMostAngles));
    }
    return static_cast<std::size_t>(value);
  }

  std::vector<float> angles(std::size_t count, const char* what) {
    std::vector<float> angles;
    for (std::size_t k = 0; k < count; ++k) {
      const float angle = number(what);
      if (k > 0 && !(angle > angles.back())) refuse(std::string("has a ") + what + " out of order");
      angles.push_back(angle);
    }
    return angles;
  }

  static bool near(float a, float b) { return std::abs(a - b) <= kAngleTolerance; }

  /// Checks angles; they are still in degrees here.
  void check_angles(IntensityProfile& profile) const {
    const float low = profile.vertical.front(), high = profile.vertical.back();
    if (low < -kAngleTolerance || high > 180 + kAngleTolerance) {
      refuse("has vertical angles outside of 0 to 180 degrees");
    }
    for (float& angle : profile.vertical) angle = std::clamp(angle, 0.0F, 180.0F);
    if (std::ranges::adjacent_find(profile.vertical, std::greater_equal<>()) !=
        profile.vertical.end()) {
      refuse("has a vertical angle out of order");
    }
    const float last = profile.horizontal.back();
    if (!near(profile.horizontal.front(), 0)) {
      refuse("has horizontal angles that do not begin with 0 degrees");
    }
    if (profile.horizontal.size() > 1 && !near(last, 90) && !near(last, 180) && !near(last, 360)) {
      refuse("has horizontal angles that do not end with 90, 180 or 360 degrees");
    }
    profile.mirrored = profile.horizontal.size() > 1 && !near(last, 360);
  }

  std::string_view rest_;
  const std::string& name_;
};

}  // namespace

std::shared_ptr<const IntensityProfile> parse_ies_profile(std::string_view text,
                                                          const std::string& name) {
  return IesReader(text, name).read();
}

}  // namespace rebounce
