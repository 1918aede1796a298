#include "precompute/facets/read_facets.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "tests/support/expect_error.h"
#include "tests/support/temporary_folder.h"

namespace rebounce::test_read_facets {
namespace {

class ReadFacets : public testing::Test {
 protected:
  Facets read(const std::string& name, const std::string& text) {
    test::write_bytes(folder_ / name, text);
    return read_facets(folder_ / name);
  }

  void expect_refused(const std::string& name, const std::string& text, const std::string& part) {
    const std::string message = test::error_of([&] { read(name, text); });
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find(name), std::string::npos) << message;
  }

  const test::TemporaryFolder folder_;
};

std::string binary_stl(std::uint32_t count,
                       std::string header = "solid as some programs write it") {
  header.resize(80);
  header.append(reinterpret_cast<const char*>(&count), sizeof(count));
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::array<float, 12> numbers = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, static_cast<float>(t)};
    header.append(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
    header.append(2, '\0');
  }
  return header;
}

TEST_F(ReadFacets, OfBinaryStl) {
  const Facets facets = read("a.stl", binary_stl(3));
  ASSERT_EQ(facets.size(), 3U);
  EXPECT_EQ(facets.vertex[facets.corners(2)[2]], glm::dvec3(0, 1, 2));
  EXPECT_TRUE(facets.exchanges(0));
}

TEST_F(ReadFacets, OfTextStl) {
  const Facets facets = read("a.STL",
                             "solid box\n facet normal 0 0 1\r\n  outer loop\n"
                             "   vertex 0 0 0\n vertex 1e0 0 0\n vertex +0 1 0.5\n  endloop\n"
                             " endfacet\nendsolid box\n");
  ASSERT_EQ(facets.size(), 1U);
  EXPECT_EQ(facets.vertex[2], glm::dvec3(0, 1, 0.5));
}

TEST_F(ReadFacets, OfObj) {
  const Facets facets = read("a.obj",
                             "# a comment\nmtllib a.mtl\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\n"
                             "v 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 3 4\nf -4 -2 -1\n");
  ASSERT_EQ(facets.size(), 2U);
  EXPECT_EQ(facets.corners(0).size(), 4U);
  EXPECT_EQ(facets.corners(1)[1], 2U);
}

TEST_F(ReadFacets, OfView3d) {
  const Facets facets = read("a.vs3",
                             "T a box\n! comment\nC out=2\nF 3\n"
                             "V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\n"
                             "S 1 1 2 3 4 0 0 0.9 floor\nO 2 1 2 3 0\nEnd of Data\nnonsense\n");
  ASSERT_EQ(facets.size(), 2U);
  EXPECT_EQ(facets.corners(0).size(), 4U);
  EXPECT_EQ(facets.corners(1).size(), 3U);
  EXPECT_TRUE(facets.exchanges(0));
  EXPECT_FALSE(facets.exchanges(1));
  EXPECT_EQ(facets.emissivity, (std::vector<double>{0.9, 1}));
}

TEST_F(ReadFacets, RefusesWhatItCannotUse) {
  test::expect_error([&] { read_facets(folder_ / "no.stl"); }, "cannot open");
  std::filesystem::create_directory(folder_ / "folder.obj");
  test::expect_error([&] { read_facets(folder_ / "folder.obj"); }, "folder.obj: Is a directory");
  expect_refused("a.ply", "ply", "give an .stl, .obj or .vs3 file");
  expect_refused("a.stl", "solid nothing\n", "has no facets");
  expect_refused("b.stl", binary_stl(3, "cut off").substr(0, 150), "has no facets");
  expect_refused("c.stl", "facet\nvertex 0 0\n", "line 2: a number is missing");
  expect_refused("d.stl", "facet\nvertex 0 0 x\n", "line 2: \"x\" is no number");
  expect_refused("e.obj", "v 0 0 0\nf 1 2 3\n", "line 2: there is no vertex 2");
  expect_refused("f.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "facet 1 has no area");
  expect_refused("g.vs3", "F 2\n", "line 1: only geometry in three dimensions");
  expect_refused("h.vs3", "F 3\nV 2 0 0 0\n", "line 2: vertices are not numbered");
  expect_refused("i.vs3", "V 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 2 0 0.9 part\n",
                 "line 4: surfaces that are parts of others");
  const std::string whole = "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\n";
  for (const char* line : {"facet normal 0 0 1\n", "vertex 0 0 0\n"}) {
    expect_refused("j.stl", whole + line, "line 7: the file ends inside a facet");
  }
}

}  // namespace
}  // namespace rebounce::test_read_facets
