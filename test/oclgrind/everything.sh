# everything.sh FOLDER -- FOLDER/everything.xml: a scene of a few pixels that calls for every part of the kernels; its
# pictures are FOLDER/a.exr and a.png.
folder=$1
{
cat <<'X'
<scene version="3.0.0">
<integrator type="volpath"><integer name="max_depth" value="4"/></integrator>
<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="0.1, 0.12, 0.15"/>
<phase type="hg"><float name="g" value="0.4"/></phase></medium>
<medium type="homogeneous" id="glow"><float name="sigma_t" value="0.5"/>
<rgb name="emission" value="0.1, 0.2, 0.1"/></medium>
<sensor type="thinlens"><float name="aperture_radius" value="0.05"/><float name="focus_distance" value="5"/>
<float name="fov" value="60"/>
<transform name="to_world"><lookat origin="0,0.5,-5" target="0,0,0" up="0,1,0"/></transform>

<ref id="fog"/><film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/></film></sensor>
<shape type="rectangle">
<transform name="to_world"><scale value="8"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>

<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></shape>
<shape type="rectangle">
<transform name="to_world"><scale value="3"/><rotate y="1" angle="180"/><translate z="3"/></transform>

<bsdf type="twosided"><bsdf type="diffuse">
<texture type="bitmap" name="reflectance"><string name="filename" value="a.png"/></texture></bsdf></bsdf></shape>
<shape type="sphere"><float name="radius" value="0.6"/><bsdf type="dielectric"/><ref name="exterior" id="fog"/></shape>
<shape type="disk"><transform name="to_world"><rotate y="1" angle="160"/><translate x="1.5"/></transform>
<bsdf type="conductor"/></shape>
<shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-1.5"/></transform>
<bsdf type="roughconductor"/></shape>
<shape type="cube"><transform name="to_world"><scale value="0.5"/><translate x="-0.5" y="1"/></transform>
<bsdf type="null"/>
<ref name="interior" id="glow"/><ref name="exterior" id="fog"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="3"/></transform>
<emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>
<shape type="sphere"><point name="center" x="2" y="2" z="0"/><float name="radius" value="0.2"/>
<emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
<emitter type="envmap"><string name="filename" value="a.exr"/></emitter>
<emitter type="directional"><vector name="direction" x="0.2" y="-1" z="0.1"/></emitter>
<emitter type="spot"><transform name="to_world"><lookat origin="0,3,-1" target="0,0,0" up="0,0,1"/></transform>
<texture type="bitmap" name="texture"><string name="filename" value="a.png"/></texture></emitter>
X
i=0
while [ $i -lt 130 ]; do
    echo "<emitter type=\"point\">"
    echo "<point name=\"position\" x=\"$((i % 13 - 6))\" y=\"2\" z=\"$((i / 13 - 5))\"/></emitter>"
    i=$((i + 1))
done
echo '</scene>'
} > "$folder/everything.xml"
