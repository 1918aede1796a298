#include "rebounce/precompute/form_factors.h"
#include <gtest/gtest.h>
#include <map>
#include "test_scenes.h"
#include "rebounce/precompute/import_gltf.h"
#include "../../precompute/hemisphere_rays.h"
namespace rebounce { namespace {
TEST(X, c) {
  PatchModel model = make_patch_model(import_gltf("/work/shared/scenes/01_cornell_measured.glb"), {.patch_count=4000});
  RayTracer tracer = test::make_tracer(model);
  uint32_t p=19; auto tri=[&](uint32_t q){ auto&v=model.mesh.triangle[model.patch_triangle[q]]; return FlatTriangle(to_dvec3(model.mesh.position[v[0]]),to_dvec3(model.mesh.position[v[1]]),to_dvec3(model.mesh.position[v[2]]));};
  FlatTriangle t=tri(p);
  std::vector<Ray> r(100000); std::vector<Hit> h(r.size()); make_hemisphere_rays(t.vertex,t.normal,7,r); tracer.intersect(r,h);
  { int hid=0,hidi=0,tot=0; std::vector<Ray> rr; std::map<uint32_t,int> who; for(uint32_t q=0;q<model.patches.size();++q) if(model.mesh.triangle_material[model.patch_triangle[q]]==2){ FlatTriangle b=tri(q); for(int k=0;k<8;k++){ auto u=square_to_triangle(r2_point(k,{.1,.2})), w=square_to_triangle(r2_point(19*k,{.3,.7}));
     Ray x{}; auto P=[&](FlatTriangle&T,glm::dvec2 u){ return offset_point(to_float3(T.vertex[0]+u.x*(T.vertex[1]-T.vertex[0])+u.y*(T.vertex[2]-T.vertex[0])),to_float3(T.normal));}; x.origin=P(t,u); Float3 y=P(b,w); x.t_near=0; x.direction={y[0]-x.origin[0],y[1]-x.origin[1],y[2]-x.origin[2]}; x.t_far=1; rr.push_back(x);} }
   std::vector<Hit> hh(rr.size()); tracer.intersect(rr,hh); for(auto&q:hh) if(q.triangle!=kNone){hidi++; who[q.triangle]++; if(hidi<5) printf("t %g tri %u front %d\n",q.t,q.triangle,q.front);} tracer.occluded(rr); for(auto&x:rr){tot++; hid+=is_occluded(x);} printf("green: %d rays, occluded %d, intersect %d\n",tot,hid,hidi); }
  std::map<uint32_t,double> mat; std::map<uint32_t,double> mc, an;
  for(auto&x:h) if(x.triangle!=kNone) { mc[model.mesh.triangle_patch[x.triangle]]+=1.0/r.size(); mat[model.mesh.triangle_material[x.triangle]]+=1.0/r.size(); }
  std::map<uint32_t,double> mata; std::vector<std::pair<double,uint32_t>> d;
  for(uint32_t q=0;q<model.patches.size();++q){ if(q==p) continue; FlatTriangle b=tri(q); double u=unoccluded_exchange_area(t,b)/t.area; an[q]=u; mata[model.mesh.triangle_material[model.patch_triangle[q]]]+=u; d.push_back({-(mc[q]-u),q}); }
  for(auto&[m,v]:mat) printf("mat %u mc %.4f unocc %.4f\n",m,v,mata[m]);
  std::sort(d.begin(),d.end()); for(int k=0;k<15;k++){ auto q=d[k].second; auto c=tri(q); printf("%u mc %.5f unocc %.5f contour %.5f  at %.1f %.1f %.1f n %.3f %.3f %.3f\n",q,mc[q],an[q],contour_exchange_area(t,c)/t.area,c.centroid.x,c.centroid.y,c.centroid.z,c.normal.x,c.normal.y,c.normal.z);}  
}
}}
