# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Packaging of foc_ros, for pip and for colcon (ament_python)."""

from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'foc_ros'
PAGES = ('play/page', 'reporting/page')
SITE = 'https://foc-ros.invalid'  # reserved by RFC 2606: replaced by the address at which the project is published
REPORT = ['Jinja2>=3.1', 'matplotlib>=3.6']

setup(
    name=PACKAGE,
    version='0.2.0',
    description='Predicts where the hand of a teleoperator is going among obstacles, with uncertainty and likelihood, on ROS 2',
    # resolved: colcon build --symlink-install runs a link to this file
    long_description=Path(__file__).resolve().with_name('README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    author='foc_ros developers',
    author_email='developers@foc-ros.invalid',
    maintainer='foc_ros developers',
    maintainer_email='developers@foc-ros.invalid',
    license='Apache-2.0',
    url=SITE,
    project_urls={
        'Documentation': f'{SITE}/doc',
        'Source': f'{SITE}/source',
        'Issues': f'{SITE}/issues',
        'Changelog': f'{SITE}/source/CHANGELOG.rst',
    },
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3 :: Only',
        *(f'Programming Language :: Python :: {version}' for version in ('3.11', '3.12', '3.13', '3.14')),
        'Topic :: Scientific/Engineering :: Artificial Intelligence',
        'Topic :: Scientific/Engineering :: Human Machine Interfaces',
        'Typing :: Typed',
    ],
    keywords=['ROS', 'teleoperation', 'motion prediction', 'stochastic optimal control', 'homotopy'],
    packages=find_packages(exclude=['test', 'test.*']),
    package_data={
        PACKAGE: ['py.typed', *(f'{page}/*.{kind}' for page in PAGES for kind in ('css', 'html', 'js')), 'recordings/*.mcap']
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/config', sorted(glob('config/*'))),
        (f'share/{PACKAGE}/launch', sorted(glob('launch/*.launch.py'))),
        (f'share/{PACKAGE}/rosdep', sorted(glob('rosdep/*.yaml'))),
        # `ros2 run foc_ros COMMAND` looks here. As console scripts they would put `node` and `demo` on everybody's PATH.
        (f'lib/{PACKAGE}', sorted(glob('scripts/ros2_run/*'))),
    ],
    zip_safe=False,
    python_requires='>=3.11',
    install_requires=[
        'cyclopts>=5.1',
        'joblib>=1.5',
        'mcap>=1.1',
        'numpy>=1.23',
        'piqp>=0.6',
        'pydantic>=2',
        'qpsolvers>=4.3',
        'PyYAML>=6.0',
        'rich>=13.0',
        'rosbags>=0.10',
        'scipy>=1.10',
    ],
    extras_require={
        # rclpy with Fast DDS and the common interfaces as wheels, for machines without a ROS installation
        'ros': ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces'],
        'report': REPORT,
        # the page on which one tries it with one's own hand
        'play': [*REPORT, 'tornado>=6.2'],
        # recordings on the workers of a Dask cluster
        'cluster': ['distributed>=2024.1'],
        # the documentation as a web site; django-static-mathjax is MathJax as a wheel, without Django
        'doc': [
            'django-static-mathjax>=3.2',
            'furo>=2024.8',
            'matplotlib>=3.6',
            'myst-parser>=4',
            'numpydoc>=1.7',
            'sphinx>=8',
            'sphinx-gallery>=0.17',
        ],
        # what the benchmark compares with
        'bench': ['casadi>=3.7'],
        # the linters, and what builds and checks the distributions
        'lint': ['import-linter>=2.1', 'mypy>=1.11', 'ruff>=0.8', 'types-PyYAML'],
        'dist': ['build>=1.2', 'setuptools>=70.1', 'twine>=5'],
        'test': [
            'daqp>=0.5',
            'distributed>=2024.1',
            'dockerfile-parse>=2',
            'hypothesis>=6.80',
            'ipykernel>=6.29',
            'mcap-ros2-support>=0.5',
            'nbclient>=0.10',
            'psutil>=5.9',
            'pytest>=7.4,<9.2',  # with 9.2, pytest-xdist 3.8 takes no notice of groups (its issue 1386)
            'pytest-timeout>=2.2',
            'pytest-xdist>=3.3',
            'quadprog>=0.1.11',
            'scipy>=1.10',
            'selenium>=4.11',
            'setuptools>=70.1',
        ],
    },
    entry_points={
        'console_scripts': [
            'foc_node = foc_ros.ros.main:main',
            'foc_ros = foc_ros.__main__:main',
        ],
    },
)
