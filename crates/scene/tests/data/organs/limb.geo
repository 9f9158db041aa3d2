// A limb around two bones, which hold it; lengths in m. `gmsh -3 limb.geo` writes limb.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Mesh.MeshSizeMax = 0.05;
Mesh.MeshSizeMin = 0.022;
Mesh.MeshSizeFromCurvature = 3;
Mesh.ElementOrder = 1;
Cone(1) = {0, 0, 0, 0, 0, 0.25, 0.06, 0.04};
Cylinder(2) = {0.01, 0.005, -0.01, 0, 0, 0.3, 0.012};
Cylinder(3) = {-0.015, -0.01, -0.01, 0, 0, 0.3, 0.006};
BooleanDifference(4) = { Volume{1}; Delete; }{ Volume{2, 3}; Delete; };
tibia() = Surface In BoundingBox{-0.0021, -0.0071, -0.001, 0.0221, 0.0171, 0.251};
fibula() = Surface In BoundingBox{-0.0211, -0.0161, -0.001, -0.0089, -0.0039, 0.251};
held() = {tibia(), fibula()};
Physical Volume("tissue") = {4};
Physical Surface("held") = {held()};
free() = CombinedBoundary{ Volume{4}; };
free() -= held();
Physical Surface("free") = {free()};
