// Contacts and what they are found with: lines, regions, the tree of boxes.

#include "precompute/patches/contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <optional>
#include <random>

#include "precompute/sampling/box_tree.h"
#include "runtime/rays/triangle.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_contacts {
namespace {

using Engine = std::mt19937;

double uniform(Engine& engine, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine);
}

glm::dvec3 point_within(Engine& engine, double reach) {
  return {uniform(engine, -reach, reach), uniform(engine, -reach, reach),
          uniform(engine, -reach, reach)};
}

ConvexRegion random_region(Engine& engine) {
  ConvexRegion region;
  for (int k = 0; k < 2; ++k) region.box.add(glm::vec3(point_within(engine, 1)));
  for (int k = 0; k < 3; ++k) {
    region.sides.push_back({glm::normalize(point_within(engine, 1)), uniform(engine, -0.2, 0.5)});
  }
  return region;
}

TEST(BoxTree, FindsTheBoxesOfAllSegmentsInARegion) {
  const unsigned seed = 31;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Engine engine(seed);
  std::vector<std::array<glm::vec3, 2>> segment(500);
  std::vector<Box> boxes(segment.size());
  for (std::size_t k = 0; k < segment.size(); ++k) {
    const glm::dvec3 begin = point_within(engine, 1);
    segment[k] = {glm::vec3(begin), glm::vec3(begin + point_within(engine, 0.3))};
    for (const glm::vec3& end : segment[k]) boxes[k].add(end);
  }
  const BoxTree tree(boxes);
  std::size_t found_count = 0, segment_count = 0;
  std::vector<std::uint32_t> found;
  for (int round = 0; round < 200; ++round) {
    const ConvexRegion region = random_region(engine);
    tree.find(region, found);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t k = 0; k < boxes.size(); ++k) {
      if (region.may_meet(boxes[k])) expected.push_back(k);
      if (!region.may_meet(segment[k][0], segment[k][1])) continue;
      ++segment_count;
      ASSERT_TRUE(region.may_meet(boxes[k]));
    }
    ASSERT_EQ(found, expected);
    found_count += found.size();
  }
  EXPECT_GT(segment_count, 1000U);
  EXPECT_LT(found_count, 200 * boxes.size() / 4) << "most are not in the regions";
}

TEST(ConvexRegion, HasWhatHasAPointInIt) {
  const unsigned seed = 37;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Engine engine(seed);
  int inside = 0;
  for (int round = 0; round < 20000; ++round) {
    const ConvexRegion region = random_region(engine);
    const glm::vec3 begin(point_within(engine, 1)), end(point_within(engine, 1));
    const glm::vec3 point = glm::mix(begin, end, uniform(engine, 0, 1));
    bool is_inside = region.box.distance_squared(point) == 0;
    for (const auto& [normal, limit] : region.sides) {
      is_inside = is_inside && glm::dot(normal, glm::dvec3(point)) < limit - 1e-6;
    }
    if (!is_inside) continue;
    ++inside;
    ASSERT_TRUE(region.may_meet(begin, end));
  }
  EXPECT_GT(inside, 200);
}

const glm::dvec3 kUp(0, 1, 0);

ContactLine line_on_floor(double x0, double z0, double x1, double z1) {
  return {{x0, 0, z0}, {x1, 0, z1}, kUp};
}

TEST(ContactLine, IsJoinedToWhatGoesOnOrOverlapsAndNothingElse) {
  const ContactLine line = line_on_floor(0, 0, 2, 0);
  const auto longest_with = [&](const ContactLine& other) {
    const auto joined = join_lines({line, other}, 0.1, 0.01);
    EXPECT_EQ(joined.size(), join_lines({other, line}, 0.1, 0.01).size());
    return joined.size() == 1 ? joined[0].length() : 0.0;
  };
  EXPECT_DOUBLE_EQ(longest_with(line_on_floor(2, 0, 3, 0)), 3) << "goes on";
  EXPECT_DOUBLE_EQ(longest_with(line_on_floor(-1, 0, -0.005, 0)), 3) << "within the tolerance";
  EXPECT_NEAR(longest_with(line_on_floor(3, 0.05, 1, -0.05)), 3, 0.01) << "overlaps, turned round";
  EXPECT_DOUBLE_EQ(longest_with(line_on_floor(0.5, 0, 1, 0)), 2) << "lies within";
  EXPECT_NEAR(longest_with(line_on_floor(-1, 0.09, 4, 0.09)), 5, 1e-12) << "is longer";
  EXPECT_EQ(longest_with(line_on_floor(2.02, 0, 3, 0)), 0) << "a gap";
  EXPECT_EQ(longest_with(line_on_floor(0, 0.2, 2, 0.2)), 0) << "beside it";
  EXPECT_EQ(longest_with(line_on_floor(1, 0, 1, 1)), 0) << "across it";
}

TEST(ContactLine, PiecesInAnyOrderBecomeTheLinesTheyWereCutFrom) {
  const unsigned seed = 41;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Engine engine(seed);
  for (int round = 0; round < 50; ++round) {
    std::vector<ContactLine> whole, pieces;
    for (int k = 0; k < 6; ++k) {
      // Lines that cross one another, but none along another.
      const double angle = std::numbers::pi * (k + uniform(engine, 0.2, 0.8)) / 6;
      const glm::dvec3 along(std::cos(angle), 0, std::sin(angle)), begin = point_within(engine, 1);
      const glm::dvec3 from(begin.x, 0, begin.z);
      const int parts = 1 + round % 9;
      const double length = uniform(engine, 1, 3);
      whole.emplace_back(from, from + length * along, kUp);
      for (int p = 0; p < parts; ++p) {
        const double first = length * p / parts, last = length * (p + 1) / parts;
        pieces.emplace_back(from + (p % 2 == 0 ? first : last) * along,
                            from + (p % 2 == 0 ? last : first) * along, kUp);
      }
    }
    std::ranges::shuffle(pieces, engine);
    const std::vector<ContactLine> lines = join_lines(pieces, 1e-3, 1e-6);
    ASSERT_EQ(lines.size(), whole.size()) << "round " << round;
    for (const ContactLine& line : whole) {
      EXPECT_TRUE(std::ranges::any_of(lines, [&](const ContactLine& found) {
        return std::abs(found.length() - line.length()) < 1e-9 &&
               std::abs(found.across(line.begin())) < 1e-9 &&
               std::abs(found.across(line.end())) < 1e-9;
      }));
    }
  }
}

/// Two lines as one, on the longer one's, or none: as join_lines says.
std::optional<ContactLine> join(const ContactLine& a, const ContactLine& b, double width,
                                double tolerance) {
  const ContactLine& longer = a.length() > b.length() ? a : b;
  const ContactLine& shorter = a.length() > b.length() ? b : a;
  const glm::dvec3 begin = shorter.begin(), end = shorter.end();
  if (std::max(std::abs(longer.across(begin)), std::abs(longer.across(end))) > width) return {};
  const auto [low, high] = std::minmax({longer.along(begin), longer.along(end)});
  if (high < -tolerance || low > longer.length() + tolerance) return {};
  return longer.part(std::min(low, 0.0), std::max(high, longer.length()));
}

/// The same lines by comparing each with all others until none can be joined.
std::vector<ContactLine> join_by_comparing(const std::vector<ContactLine>& pieces, double width,
                                           double tolerance) {
  std::vector<ContactLine> lines;
  for (ContactLine line : pieces) {
    for (std::size_t k = 0; k < lines.size();) {
      const auto joined = join(line, lines[k], width, tolerance);
      if (joined) {
        line = *joined;
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(k));
      }
      k = joined ? 0 : k + 1;
    }
    lines.push_back(line);
  }
  return lines;
}

TEST(ContactLine, JoiningFindsWhatComparingAllPairsFinds) {
  const unsigned seed = 47;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Engine engine(seed);
  std::size_t pieces_count = 0, lines_count = 0;
  for (int round = 0; round < 200; ++round) {
    // Pieces of lines through a grid, with holes and overlaps.
    std::vector<ContactLine> pieces;
    for (int k = 0; k < 300; ++k) {
      const double at = 0.5 * static_cast<double>(engine() % 9), from = uniform(engine, 0, 4),
                   to = from + uniform(engine, 0.01, 0.3);
      pieces.push_back(engine() % 2 == 0 ? line_on_floor(at, from, at, to)
                                         : line_on_floor(to, at, from, at));
    }
    const std::vector<ContactLine> expected = join_by_comparing(pieces, 1e-3, 1e-4),
                                   joined = join_lines(pieces, 1e-3, 1e-4);
    const auto lengths = [](const std::vector<ContactLine>& lines) {
      std::vector<double> length;
      for (const ContactLine& line : lines) length.push_back(line.length());
      std::ranges::sort(length);
      return length;
    };
    const std::vector<double> a = lengths(expected), b = lengths(joined);
    ASSERT_EQ(a.size(), b.size()) << "round " << round;
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], b[k], 1e-9);
    pieces_count += pieces.size();
    lines_count += joined.size();
  }
  EXPECT_LT(lines_count, pieces_count * 2 / 3);
  EXPECT_GT(lines_count, pieces_count / 10);
}

/// A wall on the floor as a row of panels, each of some strips of triangles, as modellers make
/// them; or a board that lies on it or hangs closely above it.
void add_wall(Scene& scene, const glm::dvec3& a, const glm::dvec3& b, double low, double high,
              int panels) {
  for (int k = 0; k < panels; ++k) {
    const glm::dvec3 from = glm::mix(a, b, 1.0 * k / panels),
                     to = glm::mix(a, b, (k + 1.0) / panels);
    const glm::dvec3 foot = low * kUp, top = high * kUp;
    test::add_polygon(scene, std::vector<glm::dvec3>{from + foot, to + foot, to + top, from + top});
  }
}

Scene random_scene(Engine& engine) {
  Scene scene = test::empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  scene.materials[1].double_sided = true;
  const int columns = 1 + static_cast<int>(engine() % 4);
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < columns; ++j) {
      const double s = 4.0 / columns, x = i * s - 2, z = j * s - 2;
      test::add_polygon(
          scene,
          std::vector<glm::dvec3>{{x, 0, z}, {x, 0, z + s}, {x + s, 0, z + s}, {x + s, 0, z}},
          engine() % 2);
    }
  }
  for (int k = 0; k < 4; ++k) {
    const glm::dvec3 a = point_within(engine, 1.8), b = point_within(engine, 1.8);
    const double low = k < 2 ? 0 : uniform(engine, -0.3, 0.3);
    add_wall(scene, {a.x, 0, a.z}, {b.x, 0, b.z}, low, 1.2, 1 + static_cast<int>(engine() % 9));
  }
  const glm::dvec3 at(uniform(engine, -1.5, 0.5), uniform(engine, -0.05, 0.1), 0.3);
  test::add_box(scene, at, at + glm::dvec3(0.9, 0.08, 0.7), false);
  return scene;
}

/// A piece of a contact: where a triangle passes through the plane of another, or stands on it.
std::vector<glm::dvec3> meeting(const TriangleCorners& q, std::array<double, 3> height,
                                double tolerance) {
  std::vector<glm::dvec3> ends;
  for (double& h : height) h = std::abs(h) <= tolerance ? 0 : h;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (height[k] == 0) ends.push_back(q[k]);
    if (height[k] * height[next] < 0) {
      ends.push_back(glm::mix(q[k], q[next], height[k] / (height[k] - height[next])));
    }
  }
  return ends;
}

/// All pieces in the plane of a triangle, wherever they are, without any search.
std::vector<ContactLine> all_pieces(const Scene& scene, std::uint32_t t,
                                    const ContactSettings& settings) {
  const TriangleCorners p = corners_of(scene, t);
  const glm::dvec3 normal = front_normal(p);
  const bool both_sides = scene.materials[scene.triangle_material[t]].double_sided;
  std::vector<std::array<glm::dvec3, 2>> pieces;
  std::map<std::array<Float3, 2>, int> outline;
  for (std::uint32_t other = 0; other < scene.triangle.size(); ++other) {
    const TriangleCorners q = corners_of(scene, other);
    std::array<double, 3> height;
    for (int k = 0; k < 3; ++k) height[k] = glm::dot(q[k] - p[0], normal);
    const auto [lowest, highest] = std::ranges::minmax(height);
    const bool flat = lowest >= -settings.gap && highest <= settings.gap;
    const bool behind = highest <= (flat ? -settings.tolerance : settings.tolerance);
    if (other == t || (behind && !both_sides)) continue;
    std::vector<glm::dvec3> ends = meeting(q, height, settings.tolerance);
    if (ends.size() != 2) ends = meeting(q, height, settings.gap);
    if (!flat && ends.size() == 2) pieces.push_back({ends[0], ends[1]});
    for (int k = 0; flat && k < 3; ++k) {
      const auto [a, b] = std::minmax(scene.position[scene.triangle[other][k]],
                                      scene.position[scene.triangle[other][(k + 1) % 3]]);
      ++outline[{a, b}];
    }
  }
  for (const auto& [edge, count] : outline) {
    if (count == 1) pieces.push_back({to_dvec3(edge[0]), to_dvec3(edge[1])});
  }
  std::vector<ContactLine> lines;
  for (auto& [begin, end] : pieces) {
    begin -= glm::dot(begin - p[0], normal) * normal;
    end -= glm::dot(end - p[0], normal) * normal;
    if (glm::distance(begin, end) > settings.tolerance) lines.emplace_back(begin, end, normal);
  }
  return lines;
}

/// How far a triangle reaches on the side of a line where it reaches less far, metres; 0 where they
/// share no more than `least` metres of the line.
double depth(const TriangleCorners& p, const ContactLine& line, double least) {
  std::array<double, 3> across;
  for (int k = 0; k < 3; ++k) across[k] = line.across(p[k]);
  if (!line.crosses(p, across, least)) return 0;
  const auto [lowest, highest] = std::ranges::minmax(across);
  return std::min(-lowest, highest);
}

bool is_within(const ContactLine& part, const ContactLine& line, double distance) {
  return std::ranges::all_of(std::array{part.begin(), part.end()}, [&](const glm::dvec3& end) {
    return std::abs(line.across(end)) < distance && line.along(end) > -distance &&
           line.along(end) < line.length() + distance;
  });
}

/// Lines of `a` that cut a triangle clearly, and how many of them are not in `b`, whole or in part.
std::array<int, 2> clear_and_missing(const TriangleCorners& p, const std::vector<ContactLine>& a,
                                     const std::vector<ContactLine>& b,
                                     const ContactSettings& settings) {
  std::array<int, 2> count = {0, 0};
  for (const ContactLine& line : a) {
    // Where two lines are nearer to each other than what counts as one, order decides which of them
    // takes a piece.
    const double least = 64 * settings.tolerance;
    if (line.length() < 1.1 * settings.shortest || depth(p, line, least) < least) continue;
    ++count[0];
    count[1] += std::ranges::none_of(b, [&](const ContactLine& other) {
      return is_within(line, other, 20 * settings.tolerance) ||
             is_within(other, line, 20 * settings.tolerance);
    });
  }
  return count;
}

TEST(Contacts, AreThoseThatAllPiecesMakeWithoutASearch) {
  const unsigned seed = 43;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Engine engine(seed);
  const ContactSettings settings{.shortest = 0.2, .tolerance = 4e-4, .gap = 0.2};
  int expected_count = 0, found_count = 0;
  for (int round = 0; round < 100; ++round) {
    const Scene scene = random_scene(engine);
    std::vector<std::vector<ContactLine>> found(scene.triangle.size());
    for (const Contact& c : find_contacts(scene, settings)) found[c.triangle].push_back(c.line);
    for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
      const std::vector<ContactLine> expected = join_by_comparing(
          all_pieces(scene, t, settings), 8 * settings.tolerance, settings.tolerance);
      const TriangleCorners p = corners_of(scene, t);
      const auto [all, missing] = clear_and_missing(p, expected, found[t], settings);
      const auto [all_found, added] = clear_and_missing(p, found[t], expected, settings);
      EXPECT_EQ(missing, 0) << "round " << round << ", triangle " << t;
      EXPECT_EQ(added, 0) << "round " << round << ", triangle " << t;
      expected_count += all;
      found_count += all_found;
    }
  }
  EXPECT_GT(expected_count, 1000);
  EXPECT_GT(found_count, 1000);
}

/// Blades of grass on a floor, each a triangle, in rows from wall to wall.
Scene lawn(int rows, int blades) {
  Scene scene = test::empty_scene();
  test::add_polygon(scene, std::vector<glm::dvec3>{{-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}});
  for (int row = 0; row < rows; ++row) {
    const double z = 4.0 * (row + 0.5) / rows - 2;
    for (int k = 0; k < blades; ++k) {
      const double x = 4.0 * k / blades - 2;
      test::add_polygon(scene,
                        std::vector<glm::dvec3>{{x, 0, z}, {x + 4.0 / blades, 0, z}, {x, 0.5, z}});
    }
  }
  return scene;
}

TEST(Contacts, RowsOfBladesAreOneContactEach) {
  const ContactSettings settings{.shortest = 0.1, .tolerance = 2e-4, .gap = 0.1};
  const std::vector<Contact> contacts = find_contacts(lawn(30, 20), settings);
  int on_floor = 0;
  for (const Contact& contact : contacts) {
    if (contact.triangle > 1) continue;
    ++on_floor;
    EXPECT_NEAR(contact.line.length(), 4, 1e-5);
  }
  EXPECT_EQ(on_floor, 60) << "on each of the floor's two triangles";
}

}  // namespace
}  // namespace rebounce::test_contacts
